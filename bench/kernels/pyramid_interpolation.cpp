// pyramid_interpolation -- fills the holes of a picture from what is around them: a pyramid of
// averages, weighted by alpha, then from the coarsest level up each pixel takes from the coarser
// one what its own alpha leaves.
//
// Each level is made once, in parallel strips.
#include "kernel.h"

namespace kernels {

using namespace Halide;

Kernel pyramid_interpolation(const Setup& setup) {
  const int width = setup.size(1536, 197), height = setup.size(1024, 141);
  const int levels = 9;
  ImageParam input(Float(32), 3, "input");  // red, green, blue, alpha
  Var x("x"), y("y"), c("c"), yi("yi");

  const int lanes = setup.lanes<float>();
  auto in_strips = [&](Func f, int rows) {
    f.compute_root().bound(c, 0, 4).split(y, y, yi, rows).reorder(x, c, yi, y);
    f.parallel(y).vectorize(x, lanes);
  };

  Func clamped = BoundaryConditions::repeat_edge(input);
  Func down[levels], up[levels];
  down[0] = Func("down_0");
  down[0](x, y, c) = select(c < 3, clamped(x, y, c) * clamped(x, y, 3), clamped(x, y, 3));
  in_strips(down[0], 32);
  for (int j = 1; j < levels; j++) {
    const Func& f = down[j - 1];
    Func along_x("down_x_" + std::to_string(j)), level("down_" + std::to_string(j));
    along_x(x, y, c) = (f(2 * x - 1, y, c) + 2.0f * f(2 * x, y, c) + f(2 * x + 1, y, c)) * 0.25f;
    level(x, y, c) =
        (along_x(x, 2 * y - 1, c) + 2.0f * along_x(x, 2 * y, c) + along_x(x, 2 * y + 1, c)) * 0.25f;
    down[j] = level;
    in_strips(level, j < 5 ? 8 : 4);
    along_x.store_at(level, y).compute_at(level, yi).reorder(x, c, y).vectorize(x, lanes);
  }

  up[levels - 1] = down[levels - 1];
  for (int j = levels - 2; j >= 0; j--) {
    const Func& f = up[j + 1];
    Func along_x("up_x_" + std::to_string(j)), level("up_" + std::to_string(j));
    along_x(x, y, c) = 0.5f * (f(x / 2, y, c) + f((x + 1) / 2, y, c));
    Expr coarser = 0.5f * (along_x(x, y / 2, c) + along_x(x, (y + 1) / 2, c));
    level(x, y, c) = down[j](x, y, c) + (1.0f - down[j](x, y, 3)) * coarser;
    up[j] = level;
    in_strips(level, j < 5 ? 8 : 4);
  }

  Func result("result");
  result(x, y, c) = up[0](x, y, c) / max(up[0](x, y, 3), 1e-6f);
  result.bound(c, 0, 3).split(y, y, yi, 32).reorder(x, c, yi, y).parallel(y).vectorize(x, lanes);

  Buffer<float> image = make_image<float>({width, height, 4});
  // Holes of all sizes: alpha is 0 or 1.
  for (int j = 0; j < height; j++) {
    for (int i = 0; i < width; i++) image(i, j, 3) = image(i, j, 3) > 0.6f ? 1.0f : 0.0f;
  }
  input.set(image);
  Buffer<float> output(width, height, 3);
  return {Pipeline(result),
          {image},
          {output},
          (3 + 4.0 / 3 * (4 * 8.0 / 4 * 2 + 4 * 8) + 3) * width * height};
}

}  // namespace kernels
