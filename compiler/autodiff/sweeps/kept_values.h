// kept_values.h -- adjoints read what a Func holds instead of computing it again.
//
//   f(x) = exp(g(x))         g_adj(x) = f_adj(x) * exp(g(x))    =>    g_adj(x) = f_adj(x) * f(x)
//
// The derivatives of exp, pow, tanh and others are expressions of the value itself. Where a pure
// Func has this value, and it is dearer than a way to memory and back, its adjoint reads the Func: a
// schedule that stores it computes it once, and one that inlines it computes what was there before.
#pragma once

#include <vector>

#include "autodiff/sweeps/reverse_sweep.h"
#include "graph/function.h"

namespace retrograde::autodiff {

// `values`: those of the Func's pure definition, of which the adjoint was made.
LeafAdjoint with_kept_values(const LeafAdjoint& leaf, const FuncPtr& f,
                             const std::vector<Expr>& values);

}  // namespace retrograde::autodiff
