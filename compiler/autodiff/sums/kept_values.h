// kept_values.h -- lets adjoints read a Func's stored value instead of recomputing it.
//
//   f(x) = exp(g(x))         g_adj(x) = f_adj(x) * exp(g(x))    =>    g_adj(x) = f_adj(x) * f(x)
//
// The derivatives of exp, pow, tanh and others are expressions of the value itself. If a pure Func holds that value,
// and recomputing it costs more than a memory round trip, the adjoint reads the Func. A schedule that stores the Func
// then computes the value once; a schedule that inlines it computes the same as before.
#pragma once

#include <vector>

#include "autodiff/sweeps/reverse_sweep.h"
#include "graph/function.h"

namespace retrograde::autodiff {

// `values` are those of the pure definition of a Func, from which the adjoint was derived, and `reads` read them.
LeafAdjoint with_kept_values(const LeafAdjoint& leaf, const std::vector<Expr>& reads,
                             const std::vector<Expr>& values);

}  // namespace retrograde::autodiff
