// wavelet_inverse -- inverts one level of Daubechies' transform along x: even and odd pixels are different sums of
// averages and details, selected by the parity of x. Widths are even.
#include "wavelets.h"

namespace {

struct WaveletInverse : programs::Filter<WaveletInverse, float, 3, float, 2> {
  void generate() {
    const float* h = programs::daubechies;
    Func at = Halide::BoundaryConditions::repeat_edge(input);
    auto sum = [&](float a0, float d0, float a1, float d1) {
      return a0 * at(x / 2 - 1, y, 0) + d0 * at(x / 2 - 1, y, 1) + a1 * at(x / 2, y, 0) +
             d1 * at(x / 2, y, 1);
    };
    output(x, y) = select(x % 2 == 0, sum(h[2], h[1], h[0], h[3]), sum(h[3], -h[0], h[1], -h[2]));
  }

  void schedule() {
    const int lanes = natural_vector_size<float>();
    Var xi("xi");
    output.dim(0).set_bounds(0, output.dim(0).extent() / 2 * 2);
    output.split(x, x, xi, 2, Halide::TailStrategy::RoundUp).reorder(xi, x, y).unroll(xi);
    output.vectorize(x, lanes).parallel(y, 8);
  }
};

}  // namespace

PROGRAM(wavelet_inverse, WaveletInverse,
        at_sizes({{126, 61}, {1024, 768}, {3002, 2000}}, [](const Sizes& n) {
          return std::vector{in<float>({n[0] / 2, n[1], 2}, -1, 1), out<float>({n[0], n[1]})};
        }))
