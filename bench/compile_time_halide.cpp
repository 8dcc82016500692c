// Compiles the same chains with Halide 14. The machine code is never run, so any target of this processor will do.
#include <Halide.h>

#define BENCH_LANGUAGE Halide
#include "stencil_chain.h"

namespace {

BENCHMARK(compile_stencil_chain)
    ->Name("halide_14_compiles_stencil_chain")
    ->Arg(16)
    ->Arg(32)
    ->Arg(64)
    ->Arg(125)
    ->Unit(benchmark::kMillisecond)
    ->Iterations(1)
    ->Complexity();

}  // namespace
