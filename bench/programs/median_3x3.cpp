// median_3x3 -- the median of 3 x 3 pixels of 8 bits by comparisons: columns are sorted first; then the largest of the
// minima, the median of the medians, and the smallest of the maxima (Smith 1996).
#include "program.h"

namespace {

struct Median : programs::Filter<Median, uint8_t, 2> {
  void generate() {
    Func pixel = Halide::BoundaryConditions::repeat_edge(input);
    Expr a = pixel(x, y - 1), b = pixel(x, y), c = pixel(x, y + 1);
    sorted(x, y) = Halide::Tuple(min(min(a, b), c), middle(a, b, c), max(max(a, b), c));
    auto column = [&](int dx, int which) { return sorted(x + dx, y)[which]; };
    Expr low = max(max(column(-1, 0), column(0, 0)), column(1, 0));
    Expr mid = middle(column(-1, 1), column(0, 1), column(1, 1));
    Expr high = min(min(column(-1, 2), column(0, 2)), column(1, 2));
    output(x, y) = middle(low, mid, high);
  }

  void schedule() {
    const int lanes = natural_vector_size<uint8_t>();
    Var yi("yi");
    output.split(y, y, yi, 16).parallel(y).vectorize(x, lanes);
    sorted.compute_at(output, yi).vectorize(x, lanes);
  }

 private:
  static Expr middle(Expr a, Expr b, Expr c) { return max(min(a, b), min(max(a, b), c)); }

  Func sorted{"sorted"};
};

}  // namespace

PROGRAM(median_3x3, Median, at_sizes({{129, 67}, {1000, 753}, {4000, 3001}}, [](const Sizes& n) {
          return std::vector{in<uint8_t>({n[0], n[1]}, 0, 255), out<uint8_t>({n[0], n[1]})};
        }))
