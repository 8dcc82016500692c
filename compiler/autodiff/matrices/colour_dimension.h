// colour_dimension -- one pipeline for many seeds: each Func that depends on the seed gets one more
// dimension, in which it is evaluated for another seed at each point.
//
//   f(x) = g(x - 1) * h(x),  g depends on seed   =>   f'(x, c) = g'(x - 1, c) * h(x)
//   seed(x)                                      =>   seed'(x, c)
//
// The new dimension is the outermost; every definition is pure in it, so seeds are independent and
// run in parallel. What does not depend on the seed is computed once.
#pragma once

#include "graph/function.h"

namespace retrograde::autodiff {

// `output` with seed' in place of `seed`. Unsupported when an extern stage depends on the seed.
FuncPtr with_seeds(const FuncPtr& output, const FuncPtr& seed, const FuncPtr& seeds);

}  // namespace retrograde::autodiff
