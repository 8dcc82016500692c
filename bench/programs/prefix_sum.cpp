// prefix_sum -- running sums of one long signal in blocks: within blocks sequentially, with lanes over blocks; then
// over the blocks' sums; then both combined.
#include "program.h"

namespace {

class PrefixSum : public Halide::Generator<PrefixSum> {
 public:
  GeneratorParam<int> length{"length", 64};  // of a block
  Input<Buffer<int32_t>> input{"input", 1};
  Output<Buffer<int32_t>> output{"output", 1};

  void generate() {
    Func values = Halide::BoundaryConditions::constant_exterior(input, 0);
    inside = RDom(1, length - 1, "inside");
    Expr count = (input.dim(0).extent() + length - 1) / length;
    others = RDom(1, count - 1, "others");
    local(i, b) = values(b * length + i);
    local(inside, b) += local(inside - 1, b);
    before(b) = 0;
    before(others) = before(others - 1) + local(length - 1, others - 1);
    output(x) = local(x % length, x / length) + before(x / length);
  }

  void schedule() {
    const int lanes = natural_vector_size<int32_t>();
    Var bi("bi"), xi("xi");
    local.compute_root().bound(i, 0, length).vectorize(i, lanes).parallel(b, 64);
    local.update().split(b, b, bi, lanes).reorder(bi, inside, b).vectorize(bi).parallel(b);
    before.compute_root();
    output.split(x, x, xi, length, Halide::TailStrategy::GuardWithIf).vectorize(xi, lanes);
    output.parallel(x, 64);
  }

 private:
  Var x{"x"}, i{"i"}, b{"b"};
  RDom inside, others;
  Func local{"local"}, before{"before"};
};

}  // namespace

PROGRAM(prefix_sum, PrefixSum, at_sizes({{8193}, {300001}, {4000000}}, [](const Sizes& n) {
          return std::vector{in<int32_t>({n[0]}, -100, 100).noise(), out<int32_t>({n[0]})};
        }))
