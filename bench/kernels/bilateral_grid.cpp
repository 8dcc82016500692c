// bilateral_grid -- the edge-preserving blur of Chen, Paris and Durand (2007): pixels are averaged
// in a coarse grid over x, y and brightness, which is blurred and then read back by interpolation.
//
// Each row of the grid is gathered by one task, and blurred along brightness while it is warm.
#include "kernel.h"

namespace kernels {

using namespace Halide;

namespace {

// A 5-point binomial blur of both values of a Func along one of its dimensions.
Tuple blurred(const Func& f, std::vector<Expr> at, int dimension) {
  const float weights[] = {0.0625f, 0.25f, 0.375f, 0.25f, 0.0625f};
  const Expr centre = at[dimension];
  Expr sum = 0.0f, weight = 0.0f;
  for (int i = -2; i <= 2; i++) {
    at[dimension] = centre + i;
    sum = sum + weights[i + 2] * f(at)[0];
    weight = weight + weights[i + 2] * f(at)[1];
  }
  return Tuple(sum, weight);
}

}  // namespace

Kernel bilateral_grid(const Setup& setup) {
  const int width = setup.size(2048, 191), height = setup.size(1536, 133);
  const int cell = 8, levels = 12;
  ImageParam input(Float(32), 2, "input");
  Var x("x"), y("y"), z("z"), yi("yi");

  Func clamped = BoundaryConditions::repeat_edge(input);
  Func grid("grid"), blur_z("blur_z"), blur_x("blur_x"), blur_y("blur_y"), result("result");
  RDom r(0, cell, 0, cell);
  Expr value = clamp(clamped(x * cell + r.x - cell / 2, y * cell + r.y - cell / 2), 0.0f, 1.0f);
  Expr level = cast<int>(value * levels + 0.5f);
  grid(x, y, z) = Tuple(0.0f, 0.0f);
  grid(x, y, level) = Tuple(grid(x, y, level)[0] + value, grid(x, y, level)[1] + 1.0f);
  blur_z(x, y, z) = blurred(grid, {x, y, z}, 2);
  blur_x(x, y, z) = blurred(blur_z, {x, y, z}, 0);
  blur_y(x, y, z) = blurred(blur_x, {x, y, z}, 1);

  Expr brightness = clamp(input(x, y), 0.0f, 1.0f) * levels;
  Expr below = cast<int>(brightness), fraction = brightness - below;
  Expr fx = (x % cell) * (1.0f / cell), fy = (y % cell) * (1.0f / cell);
  auto read = [&](int which) {
    auto along_x = [&](Expr gy, Expr gz) {
      return lerp(Expr(blur_y(x / cell, gy, gz)[which]), Expr(blur_y(x / cell + 1, gy, gz)[which]),
                  fx);
    };
    auto along_y = [&](Expr gz) {
      return lerp(along_x(y / cell, gz), along_x(y / cell + 1, gz), fy);
    };
    return lerp(along_y(below), along_y(below + 1), fraction);
  };
  result(x, y) = read(0) / read(1);

  const int lanes = setup.lanes<float>();
  grid.compute_at(blur_z, y).vectorize(x, lanes);
  grid.update().reorder(r.x, r.y, x, y);
  blur_z.compute_root().reorder(x, z, y).parallel(y).vectorize(x, lanes);
  blur_x.compute_at(blur_y, z).vectorize(x, lanes);
  blur_y.compute_root().parallel(z).vectorize(x, lanes);
  result.split(y, y, yi, 16).parallel(y).vectorize(x, lanes);

  Buffer<float> image = make_image<float>({width, height});
  input.set(image);
  Buffer<float> output(width, height);
  const double cells = static_cast<double>(width / cell) * (height / cell) * levels;
  return {Pipeline(result), {image}, {output}, (3 + 32.0) * width * height + 60 * cells};
}

}  // namespace kernels
