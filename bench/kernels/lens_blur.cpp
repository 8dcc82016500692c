// lens_blur -- depth of field: every pixel spreads its light over a disc whose size depends on its distance from the
// plane in focus; each point gathers from all discs that reach it.
//
// A pixel's contribution does not depend on the receiver and is computed once. Sums over the window stay in registers.
#include "kernel.h"

namespace kernels {

Kernel lens_blur(const Setup& setup) {
  const int width = setup.size(1280, 173), height = setup.size(960, 89);
  const int reach = 5;
  const float focus = 0.4f, aperture = 8.0f;
  ImageParam picture(Float(32), 3, "picture"), depth(Float(32), 2, "depth");
  Var x("x"), y("y"), c("c"), yi("yi");

  Func colour = BoundaryConditions::repeat_edge(picture);
  Func far = BoundaryConditions::repeat_edge(depth);
  Func disc("disc"), gathered("gathered"), result("result");
  Expr radius = clamp(aperture * abs(far(x, y) - focus), 0.5f, cast<float>(reach));
  // The squared radius, and the contribution to each point of the disc.
  disc(x, y) = Tuple(radius * radius, 1.0f / (radius * radius));

  RDom r(-reach, 2 * reach + 1, -reach, 2 * reach + 1);
  Expr from_x = x + r.x, from_y = y + r.y;
  Expr distance = cast<float>(r.x * r.x + r.y * r.y);
  Expr share = select(distance <= disc(from_x, from_y)[0], Expr(disc(from_x, from_y)[1]), 0.0f);
  gathered(x, y) = Tuple(0.0f, 0.0f, 0.0f, 0.0f);
  gathered(x, y) =
      Tuple(gathered(x, y)[0] + share * colour(from_x, from_y, 0),
            gathered(x, y)[1] + share * colour(from_x, from_y, 1),
            gathered(x, y)[2] + share * colour(from_x, from_y, 2), gathered(x, y)[3] + share);
  result(x, y, c) =
      mux(c, {gathered(x, y)[0], gathered(x, y)[1], gathered(x, y)[2]}) / gathered(x, y)[3];

  const int lanes = setup.lanes<float>();
  if (setup.by_hand()) {
    disc.compute_root().parallel(y, 32).vectorize(x, lanes);
    result.bound(c, 0, 3).split(y, y, yi, 16).reorder(c, x, yi, y).unroll(c);
    result.parallel(y).vectorize(x, lanes);
    gathered.compute_at(result, x).vectorize(x, lanes);
    gathered.update().reorder(x, r.x, r.y).vectorize(x, lanes);
  }

  Buffer<float> image = make_image<float>({width, height, 3});
  Buffer<float> distances = make_image<float>({width, height});
  bind(picture, image);
  bind(depth, distances);
  Buffer<float> output(width, height, 3);
  const double window = (2 * reach + 1) * (2 * reach + 1);
  return {Pipeline(result), {image, distances}, {output}, 8 * window * width * height};
}

}  // namespace kernels
