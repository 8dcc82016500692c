// Compiles the same chains with Halide 14. The machine code is never run, so any target of this processor will do.
#include <Halide.h>
#include <benchmark/benchmark.h>

#define BENCH_LANGUAGE Halide
#include "stencil_chain.h"

namespace {

void halide_14_compiles_stencil_chain(benchmark::State& state) {
  const int stages = static_cast<int>(state.range(0));
  for (auto _ : state) {
    Halide::Func last = stencil_chain(stages);
    last.compile_jit();
    benchmark::DoNotOptimize(last);
  }
  state.SetComplexityN(stages);
}
BENCHMARK(halide_14_compiles_stencil_chain)
    ->Arg(16)
    ->Arg(32)
    ->Arg(64)
    ->Arg(125)
    ->Unit(benchmark::kMillisecond)
    ->Iterations(1)
    ->Complexity();

}  // namespace
