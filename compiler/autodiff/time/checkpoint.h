// checkpoint.h -- adjoints of loops over time that run backward from a few kept states (checkpointing).
//
// The tape of tape.h keeps every value that an iteration overwrites. Here time is the outermost reduction variable of
// the update. A step is all iterations of the other variables. A state is the part of f that the update may change,
// beside its pure variables: P elements. Only some states are kept (revolve.h), and the steps between them are
// recomputed. One Func does this. Its single update follows a table of actions, in a serial loop for each element of
// the pure dimensions:
//   f_checkpoints(x, s)   [ state P | adjoint P | a | values of one step | sums | kept states ]
//   actions               store or restore a state: copies; advance: one step of the primal; record: a step that also
//                         stores the values that its partials need; adjoint: the same step backward, as on a tape
// The size of the program does not depend on the number of steps; the table has one row for each action.
//
// Contributions of a step to other Funcs are summed inside. If the element that the step read does not depend on time,
// one sum is kept for each iteration of a step, so parameters and images without a time axis take no memory for each
// step. Otherwise one value is kept for each iteration; the gradient then has a time axis, too.
#pragma once

#include "autodiff/updates/update_context.h"

namespace retrograde::autodiff {

// Whether the update is a loop over time whose values are lost, and a budget is specified.
bool wants_checkpoints(const UpdateContext& context);
// Throws if the budget cannot hold one state, if it is in bytes but the size of a state is known at run time only, or
// if a constant number of steps needs too long a table. A number of steps that is known at run time only is supported:
// the pipeline computes the table then (checkpoint_actions.h).
void differentiate_by_checkpoints(const UpdateContext& context, UpdateAdjoint& result);

}  // namespace retrograde::autodiff
