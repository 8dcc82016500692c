// pyramid_blend -- joins two pictures seamlessly along a mask: their Laplacian pyramids of five levels are mixed by the
// mask's Gaussian pyramid (Burt and Adelson 1983).
#include "program.h"

namespace {

struct PyramidBlend : programs::PictureGenerator<PyramidBlend> {
  Input<Buffer<float>> first{"first", 3}, second{"second", 3};
  Input<Buffer<float>> mask{"mask", 2};
  Output<Buffer<float>> output{"output", 3};

  void generate() {
    std::vector<Func> a = gaussian(Halide::BoundaryConditions::repeat_edge(first), "a");
    std::vector<Func> b = gaussian(Halide::BoundaryConditions::repeat_edge(second), "b");
    std::vector<Func> m = gaussian(Halide::BoundaryConditions::repeat_edge(mask), "m");
    Func result;
    for (int level = levels - 1; level >= 0; level--) {
      Func mixed("mixed_" + std::to_string(level));
      Expr p = a[level](x, y, c), q = b[level](x, y, c), share = m[level](x, y);
      if (level == levels - 1) {
        mixed(x, y, c) = lerp(q, p, share);
      } else {
        p -= up(a[level + 1])(x, y, c);
        q -= up(b[level + 1])(x, y, c);
        mixed(x, y, c) = lerp(q, p, share) + up(result)(x, y, c);
      }
      result = mixed;
      if (level > 0) whole.push_back(mixed);
    }
    output(x, y, c) = clamp(result(x, y, c), 0.0f, 1.0f);
  }

  void schedule() {
    const int lanes = natural_vector_size<float>();
    Var yi("yi");
    for (Func& f : whole) f.compute_root().vectorize(x, lanes).parallel(y, 8);
    for (auto [rows, level] : row_passes) rows.compute_at(level, y).vectorize(x, lanes);
    output.vectorize(x, lanes).split(y, y, yi, 8).parallel(y);
  }

 private:
  static constexpr int levels = 5;

  // Half the size: weights 1 3 3 1 along both axes.
  Func down(Func f, const std::string& name) {
    auto smooth = [](Expr a, Expr b, Expr c, Expr d) { return (a + 3 * (b + c) + d) / 8; };
    Func rows(name + "_rows"), small(name);
    rows(x, y, Halide::_) = smooth(f(x, 2 * y - 1, Halide::_), f(x, 2 * y, Halide::_),
                                   f(x, 2 * y + 1, Halide::_), f(x, 2 * y + 2, Halide::_));
    small(x, y, Halide::_) = smooth(rows(2 * x - 1, y, Halide::_), rows(2 * x, y, Halide::_),
                                    rows(2 * x + 1, y, Halide::_), rows(2 * x + 2, y, Halide::_));
    row_passes.push_back({rows, small});
    whole.push_back(small);
    return small;
  }

  // Twice the size: the nearest pixel counts three times as much as its neighbour.
  Func up(Func f) {
    Func rows, large;
    rows(x, y, Halide::_) =
        0.75f * f(x, y / 2, Halide::_) + 0.25f * f(x, y / 2 - 1 + 2 * (y % 2), Halide::_);
    large(x, y, Halide::_) =
        0.75f * rows(x / 2, y, Halide::_) + 0.25f * rows(x / 2 - 1 + 2 * (x % 2), y, Halide::_);
    return large;
  }

  std::vector<Func> gaussian(Func base, const std::string& name) {
    std::vector<Func> all{base};
    for (int level = 1; level < levels; level++)
      all.push_back(down(all.back(), name + std::to_string(level)));
    return all;
  }

  std::vector<Func> whole;
  std::vector<std::pair<Func, Func>> row_passes;
};

}  // namespace

PROGRAM(pyramid_blend, PyramidBlend,
        at_sizes({{128, 96}, {801, 603}, {2000, 1500}}, [](const Sizes& n) {
          return std::vector{in<float>({n[0], n[1], 3}), in<float>({n[0], n[1], 3}),
                             in<float>({n[0], n[1]}), out<float>({n[0], n[1], 3})};
        }))
