// bilateral_grid -- edge-preserving smoothing: a coarse histogram of position and brightness, blurred, and read back by
// interpolation (Chen, Paris and Durand 2007).
#include "program.h"

namespace {

struct BilateralGrid : programs::Filter<BilateralGrid, float, 2> {
  GeneratorParam<int> cell{"cell", 8};  // pixels per side
  Input<float> range{"range"};          // brightness of a cell

  void generate() {
    Func pixel = Halide::BoundaryConditions::repeat_edge(input);
    r = RDom(0, cell, 0, cell, "r");
    Expr value = clamp(pixel(x * cell + r.x - cell / 2, y * cell + r.y - cell / 2), 0.0f, 1.0f);
    grid(x, y, z, c) = 0.0f;
    grid(x, y, cast<int>(value / range + 0.5f), c) += select(c == 0, value, 1.0f);
    blur_z(x, y, z, c) = blurred([&](int d) { return grid(x, y, z + d, c); });
    blur_x(x, y, z, c) = blurred([&](int d) { return blur_z(x + d, y, z, c); });
    blur_y(x, y, z, c) = blurred([&](int d) { return blur_x(x, y + d, z, c); });

    Expr place = clamp(input(x, y), 0.0f, 1.0f) / range;
    Expr zi = cast<int>(place), zf = place - zi;
    Expr xf = cast<float>(x % cell) / cell, yf = cast<float>(y % cell) / cell;
    Expr xi = x / cell, yi = y / cell;
    auto plane = [&](Expr at) {
      return lerp(lerp(blur_y(xi, yi, at, c), blur_y(xi + 1, yi, at, c), xf),
                  lerp(blur_y(xi, yi + 1, at, c), blur_y(xi + 1, yi + 1, at, c), xf), yf);
    };
    slice(x, y, c) = lerp(plane(zi), plane(zi + 1), zf);
    output(x, y) = slice(x, y, 0) / slice(x, y, 1);
  }

  void schedule() {
    const int lanes = natural_vector_size<float>();
    grid.compute_at(blur_z, y).reorder(c, z, x, y).bound(c, 0, 2).unroll(c);
    grid.update().reorder(c, r.x, r.y, x, y).unroll(c);
    blur_z.compute_root()
        .reorder(c, x, z, y)
        .parallel(y)
        .vectorize(x, lanes)
        .unroll(c)
        .bound(c, 0, 2);
    blur_x.compute_root().reorder(c, x, y, z).parallel(z).vectorize(x, lanes).unroll(c);
    blur_y.compute_root().reorder(c, x, y, z).parallel(z).vectorize(x, lanes).unroll(c);
    output.parallel(y, 8).vectorize(x, lanes);
  }

 private:
  template <typename At>
  Expr blurred(const At& at) {
    return at(-2) + 4 * at(-1) + 6 * at(0) + 4 * at(1) + at(2);
  }

  Var z{"z"};
  RDom r;
  Func grid{"grid"}, blur_z{"blur_z"}, blur_x{"blur_x"}, blur_y{"blur_y"}, slice{"slice"};
};

}  // namespace

PROGRAM(bilateral_grid, BilateralGrid,
        at_sizes({{130, 95}, {768, 511}, {2000, 1500}}, [](const Sizes& n) {
          return std::vector{in<float>({n[0], n[1]}), value<float>(0.1f), out<float>({n[0], n[1]})};
        }))
