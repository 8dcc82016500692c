// fold_into_element.h -- adjoints of updates that fold a domain into each element, without dividing.
//
// Examples are products, log-sum-exp, compositing and Horner's rule.
//
// Primal, for i in order:   f[x] <- V(f[x], i), at the same element x in all iterations.
// Step by step:             F[x, 0] = f[x] before;  F[x, i + 1] = V(F[x, i], i)
// Transposed, i backward:   A[x, n] = A[x] after;   A[x, i] = A[x, i + 1] dV/df (F[x, i], i)
//                           contributions to others are swept with A[x, i + 1]
//
// For a product, F holds the products before each factor, and A those after it times the seed. Nothing is divided by a
// factor, which may be 0. Both are recurrences with affine indices, so they can be differentiated again. F is built
// only if a partial needs it (version_budget.h). The price is memory for every iteration; a tape (tape.h) would in
// addition save and clear the adjoint in each iteration.
#pragma once

#include "autodiff/updates/update_context.h"

namespace retrograde::autodiff {

// Whether all iterations that reach an element read and write that element only.
bool is_fold(const UpdateContext& context);
// Throws if a partial needs an overwritten value that may not be kept.
void differentiate_fold(const UpdateContext& context, UpdateAdjoint& result);

}  // namespace retrograde::autodiff
