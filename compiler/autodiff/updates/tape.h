// Any update at all, run backward iteration by iteration.
//
// Primal, for i in order:          reads k:  v_k = f[R_k(i)];   write: f[W(i)] <- V(v_1, v_2, ...)
// Transposed, i in reverse order:  a(i) = A[W(i)];  A[W(i)] = 0;
//                                  for all k: A[R_k(i)] += a(i) dV/dv_k
//
// Both sides are one Func with one more dimension, and one update whose innermost reduction
// variable is the step inside an iteration:
//   f_tape(x, s)      s < P: the elements of f beside its pure variables x, in storage order;
//                     s >= P: the values v_k(i) that partials and places need (version_budget.h)
//   f_adj_tape(x, s)  s < P: A; s >= P: a(i), from which contributions to others are swept
// No index set is looked at: places may depend on data, iterations may meet. The price is memory
// for every iteration, and a serial loop over them in each element of the pure dimensions, which
// stay parallel: nothing is shared between two of those.
#pragma once

#include "autodiff/updates/update_context.h"

namespace retrograde::autodiff {

// Throws when a value is needed that was overwritten and may not be kept.
void differentiate_by_tape(const UpdateContext& context, UpdateAdjoint& result);

}  // namespace retrograde::autodiff
