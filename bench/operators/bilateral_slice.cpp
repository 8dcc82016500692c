// bilateral_slice -- reads a grid of 12 affine coefficients at each pixel's position and guide, and applies them to the
// pixel. Gradients: image, guide and grid. Source: Gharbi et al., Deep Bilateral Learning for Real-Time Image
// Enhancement, SIGGRAPH 2017.
#include "operator.h"

namespace kernels {

namespace {

// The two cells next to a position, and the weight of the far one.
struct Cells {
  Expr near, far, weight;
};
Cells cells_at(const Expr& place, int count) {
  Expr near = clamp(cast<int>(floor(place)), 0, count - 1);
  return {near, min(near + 1, count - 1), place - floor(place)};
}

}  // namespace

Kernel bilateral_slice(const Setup& setup) {
  const int width = setup.size(1024, 37), height = setup.size(1024, 29);
  const int cells = setup.size(64, 5), levels = setup.size(8, 4);
  const Buffer<real> image = make_values({width, height, 3}, 0, 1);
  const Buffer<real> guide = off_grid(make_waves({width, height}, -0.05f, 1.05f, 61), 2048);
  const Buffer<real> grid = make_noise({cells, cells, levels, 4, 3}, 1);
  Var x("x"), y("y"), k("k"), c("c");
  auto place = [&](const Var& at, int size) -> Expr {
    return clamp((at + 0.5f) * (static_cast<float>(cells) / size) - 0.5f, 0.0f, cells - 1.0f);
  };
  Func depth("depth"), coefficients("coefficients"), sliced("sliced");
  depth(x, y) = clamp(guide(x, y) * levels - 0.5f, 0.0f, levels - 1.0f);
  const Cells i = cells_at(place(x, width), cells), j = cells_at(place(y, height), cells);
  const Cells l = cells_at(depth(x, y), levels);
  auto level = [&](const Expr& z) {
    return lerp(lerp(grid(i.near, j.near, z, k, c), grid(i.far, j.near, z, k, c), i.weight),
                lerp(grid(i.near, j.far, z, k, c), grid(i.far, j.far, z, k, c), i.weight),
                j.weight);
  };
  coefficients(x, y, k, c) = lerp(level(l.near), level(l.far), l.weight);
  Expr sum = coefficients(x, y, 3, c);
  for (int channel = 0; channel < 3; channel++)
    sum += coefficients(x, y, channel, c) * image(x, y, channel);
  sliced(x, y, c) = sum;
  return gradients_of(setup, sliced, {width, height, 3}, {image, guide, grid},
                      12.0 * 50 * width * height);
}

}  // namespace kernels
