// harris_corners -- the corner response of Harris and Stephens (1988) over 3 x 3 windows of Sobel
// gradients, from a colour image.
//
// In tiles: first luminance and gradients of a tile with its border, then the response.
#include "kernel.h"

namespace kernels {

Kernel harris_corners(const Setup& setup) {
  const int width = setup.size(2304, 331), height = setup.size(1536, 119);
  ImageParam input(Float(32), 3, "input");
  Var x("x"), y("y"), tx("tx"), ty("ty");

  Func clamped = BoundaryConditions::repeat_edge(input);
  Func grey("grey"), slope_x("slope_x"), slope_y("slope_y"), response("response");
  grey(x, y) = 0.299f * clamped(x, y, 0) + 0.587f * clamped(x, y, 1) + 0.114f * clamped(x, y, 2);
  auto sobel = [&](Expr ahead_1, Expr ahead_2, Expr ahead_3, Expr back_1, Expr back_2,
                   Expr back_3) {
    return ((ahead_1 - back_1) + 2.0f * (ahead_2 - back_2) + (ahead_3 - back_3)) * 0.125f;
  };
  slope_x(x, y) = sobel(grey(x + 1, y - 1), grey(x + 1, y), grey(x + 1, y + 1), grey(x - 1, y - 1),
                        grey(x - 1, y), grey(x - 1, y + 1));
  slope_y(x, y) = sobel(grey(x - 1, y + 1), grey(x, y + 1), grey(x + 1, y + 1), grey(x - 1, y - 1),
                        grey(x, y - 1), grey(x + 1, y - 1));
  Expr xx = 0.0f, xy = 0.0f, yy = 0.0f;
  for (int j = -1; j <= 1; j++) {
    for (int i = -1; i <= 1; i++) {
      Expr sx = slope_x(x + i, y + j), sy = slope_y(x + i, y + j);
      xx = xx + sx * sx;
      xy = xy + sx * sy;
      yy = yy + sy * sy;
    }
  }
  Expr trace = xx + yy;
  response(x, y) = xx * yy - xy * xy - 0.04f * trace * trace;

  const int lanes = setup.lanes<float>();
  if (setup.by_hand()) {
    response.tile(x, y, tx, ty, 256, 32).parallel(y).vectorize(tx, lanes);
    for (Func f : {grey, slope_x, slope_y}) f.compute_at(response, x).vectorize(x, lanes);
  }

  Buffer<float> image = make_image<float>({width, height, 3});
  bind(input, image);
  Buffer<float> result(width, height);
  return {Pipeline(response), {image}, {result}, (5 + 14 + 54 + 7.0) * width * height};
}

}  // namespace kernels
