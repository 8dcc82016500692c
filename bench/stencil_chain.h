// stencil_chain.h -- the benchmark of a chain of stencils, every stage at root, vectorized and parallel; the same source
// for both languages. Define BENCH_LANGUAGE as the namespace before including it.
#pragma once

#include <benchmark/benchmark.h>

#include <string>

static BENCH_LANGUAGE::Func stencil_chain(int stages) {
  using namespace BENCH_LANGUAGE;
  Var x("x"), y("y");
  Func previous("stage_0");
  previous(x, y) = cast<float>(x * 3 + y);
  previous.compute_root().vectorize(x, 8).parallel(y, 16);
  for (int i = 1; i < stages; i++) {
    Func next("stage_" + std::to_string(i));
    next(x, y) =
        (previous(x - 1, y) + previous(x, y) * 2.0f + previous(x + 1, y) + previous(x, y + 1)) *
        0.2f;
    next.compute_root().vectorize(x, 8).parallel(y, 16);
    previous = next;
  }
  return previous;
}

static void compile_stencil_chain(benchmark::State& state) {
  const int stages = static_cast<int>(state.range(0));
  for (auto _ : state) {
    BENCH_LANGUAGE::Func last = stencil_chain(stages);
    last.compile_jit();
    benchmark::DoNotOptimize(last);
  }
  state.SetComplexityN(stages);
}
