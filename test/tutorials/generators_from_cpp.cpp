// Generators used in the same program: created, configured, given inputs, run.
#include "Halide.h"

#include <cstdio>

using namespace Halide;

namespace {

class Scale : public Generator<Scale> {
 public:
  GeneratorParam<int> factor{"factor", 2};
  Input<Func> input{"input", 2};
  Output<Func> output{"output", 2};
  void generate() { output(x, y) = input(x, y) * factor; }
  void schedule() { output.compute_root().vectorize(x, natural_vector_size(output.types()[0])); }

 private:
  Var x{"x"}, y{"y"};
};

class Threshold : public Generator<Threshold> {
 public:
  Input<Buffer<>> input{"input", 2};
  Input<int> limit{"limit"};
  Output<Buffer<uint8_t>> output{"output", 2};
  void generate() { output(x, y) = select(input(x, y) > limit, cast<uint8_t>(255), 0); }

 private:
  Var x{"x"}, y{"y"};
};

}  // namespace

int main() {
  GeneratorContext context(get_jit_target_from_environment());
  Var x("x"), y("y");
  Func source("source");
  source(x, y) = x + y * 3;

  // One generator reads the result of another.
  auto scale = context.create<Scale>();
  scale->factor.set(5);
  scale->apply(source);
  Buffer<int> scaled = scale->realize({8, 4});
  printf("scaled: %d %d\n", scaled(1, 0), scaled(7, 3));

  auto threshold = context.create<Threshold>();
  threshold->apply(scaled, 30);
  Buffer<uint8_t> result = threshold->realize({8, 4});
  for (int j = 0; j < 4; j++) {
    for (int i = 0; i < 8; i++) printf("%4d", result(i, j));
    printf("\n");
  }

  // The output of a generator is a Func that other Funcs can read.
  auto twice = context.apply<Scale>(source);
  Func combined("combined");
  combined(x, y) = twice->output(x, y) + source(x, y);
  Buffer<int> sum = combined.realize({8, 4});
  printf("combined: %d\n", sum(7, 3));
  return 0;
}
