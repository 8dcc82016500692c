// wavelet_forward -- one level of Daubechies' transform along x of each row: averages in plane 0,
// details in plane 1, both half as wide.
#include "wavelets.h"

namespace {

struct WaveletForward : programs::Filter<WaveletForward, float, 2, float, 3> {
  void generate() {
    const float* h = programs::daubechies;
    Func at = Halide::BoundaryConditions::repeat_edge(input);
    auto tap = [&](int i) -> Expr { return at(2 * x + i, y); };
    Expr average = h[0] * tap(0) + h[1] * tap(1) + h[2] * tap(2) + h[3] * tap(3);
    Expr detail = h[3] * tap(0) - h[2] * tap(1) + h[1] * tap(2) - h[0] * tap(3);
    output(x, y, c) = select(c == 0, average, detail);
  }

  void schedule() {
    output.bound(c, 0, 2).reorder(c, x, y).unroll(c);
    output.vectorize(x, natural_vector_size<float>()).parallel(y, 8);
  }
};

}  // namespace

PROGRAM(wavelet_forward, WaveletForward,
        at_sizes({{127, 61}, {1024, 768}, {3001, 2000}}, [](const Sizes& n) {
          return std::vector{in<float>({n[0], n[1]}), out<float>({(n[0] + 1) / 2, n[1], 2})};
        }))
