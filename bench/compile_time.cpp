// How the time to compile grows with the length of a pipeline: chains of stencils, every stage at root, vectorized and
// parallel, from the Func graph to callable machine code. The fitted complexity is printed last and should be O(N).
#include <benchmark/benchmark.h>

#include <string>

#include "retrograde/retrograde.h"

namespace {

using namespace retrograde;

Func stencil_chain(int stages) {
  Var x("x"), y("y");
  Func previous("stage_0");
  previous(x, y) = cast<float>(x * 3 + y);
  previous.compute_root().vectorize(x, 8).parallel(y, 16);
  for (int i = 1; i < stages; i++) {
    Func next("stage_" + std::to_string(i));
    next(x, y) = (previous(x - 1, y) + previous(x, y) * 2.0f + previous(x + 1, y) + previous(x, y + 1)) * 0.2f;
    next.compute_root().vectorize(x, 8).parallel(y, 16);
    previous = next;
  }
  return previous;
}

void compile_stencil_chain(benchmark::State& state) {
  const int stages = static_cast<int>(state.range(0));
  for (auto _ : state) {
    // A new chain every time: its names differ, so no cache answers.
    Func last = stencil_chain(stages);
    last.compile_jit();
    benchmark::DoNotOptimize(last);
  }
  state.SetComplexityN(stages);
  state.counters["ms_per_stage"] = benchmark::Counter(stages * 1e-3, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}
BENCHMARK(compile_stencil_chain)->Arg(16)->Arg(32)->Arg(64)->Arg(125)->Arg(250)->Arg(500)->Unit(benchmark::kMillisecond)->Complexity(benchmark::oN);

}  // namespace

BENCHMARK_MAIN();
