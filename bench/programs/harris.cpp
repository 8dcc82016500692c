// harris -- the corner response of each pixel (Harris and Stephens 1988), from a colour picture.
#include "program.h"

namespace {

struct Harris : programs::Filter<Harris, float, 3, float, 2> {
  void generate() {
    grey(x, y) = 0.299f * input(x, y, 0) + 0.587f * input(x, y, 1) + 0.114f * input(x, y, 2);
    auto across = [&](int dy) { return grey(x + 1, y + dy) - grey(x - 1, y + dy); };
    auto down = [&](int dx) { return grey(x + dx, y + 1) - grey(x + dx, y - 1); };
    dx(x, y) = (across(-1) + 2 * across(0) + across(1)) / 12;
    dy(x, y) = (down(-1) + 2 * down(0) + down(1)) / 12;
    xx(x, y) = dx(x, y) * dx(x, y);
    yy(x, y) = dy(x, y) * dy(x, y);
    xy(x, y) = dx(x, y) * dy(x, y);
    Expr a = box(xx), b = box(xy), d = box(yy), trace = a + d;
    output(x, y) = a * d - b * b - 0.04f * trace * trace;
  }

  void schedule() {
    Var yi("yi");
    const int lanes = natural_vector_size<float>();
    output.split(y, y, yi, 32).parallel(y).vectorize(x, lanes);
    for (Func* f : {&grey, &dx, &dy})
      f->store_at(output, y).compute_at(output, yi).vectorize(x, lanes);
    dx.compute_with(dy, x);
  }

 private:
  Expr box(Func f) {
    Expr sum = 0.0f;
    for (int j = -1; j <= 1; j++) {
      for (int i = -1; i <= 1; i++) sum += f(x + i, y + j);
    }
    return sum;
  }

  Func grey{"grey"}, dx{"dx"}, dy{"dy"}, xx{"xx"}, yy{"yy"}, xy{"xy"};
};

}  // namespace

PROGRAM(harris, Harris, at_sizes({{123, 75}, {1022, 701}, {2556, 1500}}, [](const Sizes& n) {
          return std::vector{in<float>({n[0] + 4, n[1] + 4, 3}).from({-2, -2, 0}),
                             out<float>({n[0], n[1]})};
        }))
