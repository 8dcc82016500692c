// softmax_rows -- the softmax of each row of a matrix: largest element, sum of exponentials,
// quotient.
#include "program.h"

namespace {

class SoftmaxRows : public Halide::Generator<SoftmaxRows> {
 public:
  Input<Buffer<float>> input{"input", 2};  // (class, row)
  Output<Buffer<float>> output{"output", 2};

  void generate() {
    r = RDom(0, input.dim(0).extent(), "r");
    largest(y) = -1e30f;
    largest(y) = max(largest(y), input(r, y));
    power(x, y) = Halide::exp(input(x, y) - largest(y));
    total(y) += power(r, y);
    inverse(y) = 1.0f / total(y);
    output(x, y) = power(x, y) * inverse(y);
  }

  void schedule() {
    const int lanes = natural_vector_size<float>();
    input.dim(0).set_min(0);
    output.parallel(y, 4).vectorize(x, lanes);
    largest.compute_at(output, y);
    reduce_in_lanes(largest, lanes);
    power.compute_at(output, y).vectorize(x, lanes);
    total.compute_at(output, y);
    reduce_in_lanes(total, lanes);
    inverse.compute_at(output, y);
  }

 private:
  // One partial result per lane, then the reduction of the lanes.
  void reduce_in_lanes(Func f, int lanes) {
    RVar ro("ro"), ri("ri");
    Var lane("lane");
    f.update().split(r, ro, ri, lanes, Halide::TailStrategy::GuardWithIf);
    Func parts = f.update().rfactor(ri, lane);
    parts.compute_at(output, y).vectorize(lane).update().reorder(lane, ro).vectorize(lane);
  }

  Var x{"x"}, y{"y"};
  RDom r;
  Func largest{"largest"}, power{"power"}, total{"total"}, inverse{"inverse"};
};

}  // namespace

PROGRAM(softmax_rows, SoftmaxRows,
        at_sizes({{61, 40}, {1000, 256}, {4096, 2048}}, [](const Sizes& n) {
          return std::vector{in<float>({n[0], n[1]}, -5, 5).noise(), out<float>({n[0], n[1]})};
        }))
