// bilateral_grid -- Chen, Paris and Durand (2007), "Real-time edge-aware image processing with the bilateral grid":
// pixels are accumulated in a coarse grid over brightness and position, the grid is smoothed, and it is read back at
// each pixel's own brightness and position (sections 3.1 to 3.3).
//
// Brightness is innermost in memory, so that the pixels of one cell fall into one short vector; the grid is a picture
// of such vectors.
#include "kernel.h"

#include <cmath>

namespace kernels {

namespace {

// The sum of brightness over all pixels of a cell and bin, and their number: the paper's homogeneous value, whose
// quotient is the mean.
struct Homogeneous {
  Expr value, weight;
  Homogeneous(Expr v, Expr w) : value(v), weight(w) {}
  Homogeneous(FuncRef f) : value(f[0]), weight(f[1]) {}
  operator Tuple() const { return Tuple(value, weight); }
  Homogeneous operator+(const Homogeneous& o) const { return {value + o.value, weight + o.weight}; }
  Homogeneous operator*(Expr k) const { return {value * k, weight * k}; }
};

Homogeneous between(const Homogeneous& a, const Homogeneous& b, Expr part) {
  return {lerp(a.value, b.value, part), lerp(a.weight, b.weight, part)};
}

// A Gaussian one cell wide, truncated at two cells, along one axis of the grid. Its scale cancels in the quotient.
Func smoothed(const Func& grid, int axis, const std::string& name) {
  const std::vector<Var> place = grid.args();
  auto tap = [&](int offset) {
    std::vector<Expr> at(place.begin(), place.end());
    at[axis] = at[axis] + offset;
    return Homogeneous(grid(at)) * std::exp(-0.5f * offset * offset);
  };
  Func result(name);
  result(place) = tap(-2) + tap(-1) + tap(0) + tap(1) + tap(2);
  return result;
}

}  // namespace

Kernel bilateral_grid(const Setup& setup) {
  const int width = setup.size(2048, 191), height = setup.size(1536, 133);
  const int cell = 8;        // pixels along a side
  const float bins = 12.0f;  // of brightness, 0 to 1
  ImageParam input(Float(32), 2, "input");
  Var x("x"), y("y"), bin("bin"), column("column"), row("row"), strip("strip");

  // Each pixel contributes to its nearest grid point.
  Func extended = BoundaryConditions::repeat_edge(input), splat("splat");
  RDom pixel(-cell / 2, cell, -cell / 2, cell);
  Expr brightness = clamp(extended(column * cell + pixel.x, row * cell + pixel.y), 0.0f, 1.0f);
  Expr nearest = cast<int>(round(brightness * bins));
  splat(bin, column, row) = Homogeneous(0.0f, 0.0f);
  splat(nearest, column, row) =
      Homogeneous(splat(nearest, column, row)) + Homogeneous(brightness, 1.0f);

  Func by_row = smoothed(splat, 2, "by_row");
  Func by_column = smoothed(by_row, 1, "by_column"), grid = smoothed(by_column, 0, "grid");

  // Trilinear interpolation of the eight surrounding grid points.
  Func result("result");
  Expr own = clamp(input(x, y), 0.0f, 1.0f) * bins, low = cast<int>(own);
  Expr i = x / cell, j = y / cell;
  auto in_bin = [&](Expr b) {
    auto in_row = [&](Expr r) {
      return between(grid(b, i, r), grid(b, i + 1, r), cast<float>(x % cell) / cell);
    };
    return between(in_row(j), in_row(j + 1), cast<float>(y % cell) / cell);
  };
  const Homogeneous mean = between(in_bin(low), in_bin(low + 1), own - low);
  result(x, y) = mean.value / mean.weight;

  const int lanes = setup.lanes<float>();
  if (setup.by_hand()) {
    splat.compute_root().parallel(row).vectorize(bin, lanes);
    splat.update().reorder(pixel.x, pixel.y, column, row).parallel(row);
    grid.compute_root().parallel(row).vectorize(bin, lanes);
    by_column.compute_at(grid, column).vectorize(bin, lanes);
    by_row.compute_at(grid, row).vectorize(bin, lanes);
    result.split(y, strip, y, cell).parallel(strip).vectorize(x, lanes);
  }

  Buffer<float> image = make_image<float>({width, height});
  bind(input, image);
  Buffer<float> output(width, height);
  const double cells = static_cast<double>(width / cell) * (height / cell) * (bins + 1);
  return {Pipeline(result), {image}, {output}, (3 + 32.0) * width * height + 54 * cells};
}

}  // namespace kernels
