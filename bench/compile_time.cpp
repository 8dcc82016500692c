// Measures how compile time grows with the length of a pipeline, from the Func graph to callable machine code. The
// fitted complexity is printed last and should be N. Halide 14 compiles the shorter chains in the same run.
#include <benchmark/benchmark.h>

#include "retrograde/retrograde.h"

#define BENCH_LANGUAGE retrograde
#include "stencil_chain.h"

namespace {

BENCHMARK(compile_stencil_chain)
    ->Arg(16)
    ->Arg(32)
    ->Arg(64)
    ->Arg(125)
    ->Arg(250)
    ->Arg(500)
    ->Unit(benchmark::kMillisecond)
    ->Iterations(1)  // the compile cache would make a second compilation of the same function free
    ->Complexity(benchmark::oN);

}  // namespace

BENCHMARK_MAIN();
