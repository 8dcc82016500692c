// Updates that fold a domain into each element: products, log-sum-exp, compositing, Horner's rule.
//
// Primal, for i in order:   f[x] <- V(f[x], i), at the same place x in all iterations.
// Step by step:             F[x, 0] = f[x] before;  F[x, i + 1] = V(F[x, i], i)
// Transposed, i backward:   A[x, n] = A[x] after;   A[x, i] = A[x, i + 1] dV/df (F[x, i], i)
//                           contributions to others are swept with A[x, i + 1]
//
// For a product, F holds the products before each factor and A those after it, times the seed:
// nothing is divided by a factor that may be 0. Both are recurrences at known places, so they
// differentiate again. F is made only if a partial needs it (version_budget.h). The price is
// memory for every iteration; a tape (tape.h) would also save and clear the adjoint in each.
#pragma once

#include "autodiff/updates/update_context.h"

namespace retrograde::autodiff {

// Whether all iterations that reach an element write and read that one only.
bool is_fold(const UpdateContext& context);
// Throws when a value is needed that was overwritten and may not be kept.
void differentiate_fold(const UpdateContext& context, UpdateAdjoint& result);

}  // namespace retrograde::autodiff
