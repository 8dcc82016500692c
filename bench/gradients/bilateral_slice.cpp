// bilateral_slice -- an affine grid, sliced by position and brightness. Gradients: grid and image. Source: Gharbi et
// al., Deep Bilateral Learning for Real-Time Image Enhancement, SIGGRAPH 2017, section 3.3.
#include "gradient.h"

namespace kernels {

Kernel bilateral_slice(const Setup& setup) {
  const int width = setup.size(512, 21), height = setup.size(384, 17);
  const int cells = 16, levels = 8;
  const Buffer<float> grid = make_values({cells + 1, cells + 1, levels + 1, 2}, -1, 1);
  const Buffer<float> image = make_values({width, height}, 0.01f, 0.99f);
  Var x("x"), y("y"), c("c");
  Expr gx = cast<float>(x) * (static_cast<float>(cells) / static_cast<float>(width));
  Expr gy = cast<float>(y) * (static_cast<float>(cells) / static_cast<float>(height));
  Expr gz = clamp(image(x, y), 0.0f, 0.999f) * static_cast<float>(levels);
  Expr ix = cast<int>(floor(gx)), iy = cast<int>(floor(gy));
  Expr iz = clamp(cast<int>(floor(gz)), 0, levels - 1);
  Expr wx = gx - floor(gx), wy = gy - floor(gy), wz = gz - floor(gz);
  auto plane = [&](const Expr& z) {
    return lerp(lerp(grid(ix, iy, z, c), grid(ix + 1, iy, z, c), wx),
                lerp(grid(ix, iy + 1, z, c), grid(ix + 1, iy + 1, z, c), wx), wy);
  };
  Func affine("affine"), sliced("sliced");
  affine(x, y, c) = lerp(plane(iz), plane(iz + 1), wz);
  sliced(x, y) = affine(x, y, 0) * image(x, y) + affine(x, y, 1);
  return gradients_of(setup, sliced, {width, height}, {grid, image}, 60.0 * width * height);
}

}  // namespace kernels
