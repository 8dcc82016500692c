// tape.h -- adjoints of arbitrary updates: the iterations run backward one by one on a tape.
//
// Primal, for i in order:          reads k:  v_k = f[R_k(i)];   write: f[W(i)] <- V(v_1, v_2, ...)
// Transposed, i in reverse order:  a(i) = A[W(i)];  A[W(i)] = 0;
//                                  for all k: A[R_k(i)] += a(i) dV/dv_k
//
// Forward and backward loop are one Func each, with one more dimension. Each Func has one update, whose innermost
// reduction variable counts the steps inside an iteration:
//   f_tape(x, s)      s < P: the elements of f beside its pure variables x, in storage order;
//                     s >= P: the values v_k(i) that partials and indices need (version_budget.h)
//   f_adj_tape(x, s)  s < P: A; s >= P: a(i), from which contributions to others are swept
//
// No index sets are analysed: indices may depend on data, and iterations may write the same element. The price is
// memory for every iteration and a serial loop over them in each element of the pure dimensions. The pure dimensions
// stay parallel, because their elements share nothing.
#pragma once

#include "autodiff/updates/update_context.h"

namespace retrograde::autodiff {

// Throws if a partial needs an overwritten value that may not be kept.
void differentiate_by_tape(const UpdateContext& context, UpdateAdjoint& result);

}  // namespace retrograde::autodiff
