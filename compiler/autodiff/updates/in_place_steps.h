// in_place_steps.h -- adjoints of updates that overwrite elements in steps, where the points of one step are independent
// of each other. Red-black relaxation is an example.
//
// Primal, for s in order, for all p:  f[W(p)] <- V(f[R_1(p)], ..., p, s)        at most once per element and step
// Step by step:                       F[e, 0] = f[e] before
//                                     F[W(p), s + 1] = V(F[R_1(p), s], ..., p, s)
//                                     F[e, s] = f[e] before, for elements e that are no W(p)
// Transposed:                         a recurrence over F, whose last step has the adjoint after the update
//
// A predicate chooses between V and F[W(p), s]. Both F and its adjoint keep all steps, one below the other, and the
// points of a step can run in parallel and in vectors. A tape (tape.h) would run one by one.
#pragma once

#include "autodiff/updates/update_context.h"

namespace retrograde::autodiff {

// Returns false, and leaves `result` unchanged, if the update has another shape, or a partial needs a value of the Func
// and no version may be kept. Throws if the versions exceed their budget.
bool differentiate_in_place_steps(const UpdateContext& context, UpdateAdjoint& result);

}  // namespace retrograde::autodiff
