// colour_dimension.h -- evaluates one pipeline for many seeds, by a new dimension in each Func that depends on the
// seed.
//
//   f(x) = g(x - 1) * h(x),  g depends on seed   =>   f'(x, c) = g'(x - 1, c) * h(x)
//   seed(x)                                      =>   seed'(x, c)
//
// The new dimension is the outermost. Every definition is pure in it, so seeds are independent and run in parallel.
// Funcs that do not depend on the seed are computed once.
#pragma once

#include "graph/function.h"

namespace retrograde::autodiff {

// Returns `output` with `seeds` (seed' above) in place of `seed`. Throws Unsupported if an extern stage depends on the
// seed.
FuncPtr with_seeds(const FuncPtr& output, const FuncPtr& seed, const FuncPtr& seeds);

}  // namespace retrograde::autodiff
