// unsharp -- a grey picture minus its blur, added back in the ratio of the colours.
#include "program.h"

namespace {

struct Unsharp : programs::Filter<Unsharp, float, 3> {
  Input<float> amount{"amount"};

  void generate() {
    Func pixel = Halide::BoundaryConditions::mirror_interior(input);
    grey(x, y) = 0.299f * pixel(x, y, 0) + 0.587f * pixel(x, y, 1) + 0.114f * pixel(x, y, 2);
    const float sigma = 1.5f;
    auto weight = [&](int d) {
      return Halide::exp(-d * d / (2 * sigma * sigma)) / (2.5066283f * sigma);
    };
    auto blurred = [&](auto at) {
      Expr sum = weight(0) * at(0);
      for (int d = 1; d <= 3; d++) sum += weight(d) * (at(d) + at(-d));
      return sum;
    };
    down(x, y) = blurred([&](int d) { return Expr(grey(x, y + d)); });
    across(x, y) = blurred([&](int d) { return Expr(down(x + d, y)); });
    Expr sharp = grey(x, y) + amount * (grey(x, y) - across(x, y));
    ratio(x, y) = sharp / max(grey(x, y), 0.001f);
    output(x, y, c) = ratio(x, y) * pixel(x, y, c);
  }

  void schedule() {
    const int lanes = natural_vector_size<float>();
    Var yi("yi");
    output.bound(c, 0, 3).split(y, y, yi, 16).reorder(x, c, yi, y).parallel(y).vectorize(x, lanes);
    grey.store_at(output, y).compute_at(output, yi).vectorize(x, lanes);
    down.compute_at(output, yi).vectorize(x, lanes);
    ratio.compute_at(output, yi).vectorize(x, lanes);
  }

 private:
  Func grey{"grey"}, down{"down"}, across{"across"}, ratio{"ratio"};
};

}  // namespace

PROGRAM(unsharp, Unsharp, at_sizes({{129, 67}, {1000, 753}, {2400, 1600}}, [](const Sizes& n) {
          return std::vector{in<float>({n[0], n[1], 3}), value<float>(0.7f),
                             out<float>({n[0], n[1], 3})};
        }))
