// A loop over time, run backward from a few kept states.
//
// The tape of tape.h keeps what every iteration overwrites. Here time is the outermost reduction
// variable of the update, a step is all iterations of the others, and a state is what the update
// may change of f beside its pure variables: P elements. Only some states are kept (revolve.h), the
// steps between them are computed again. One Func does it, with one update that follows a table of
// actions, a serial loop inside each element of the pure dimensions:
//   f_checkpoints(x, s)   [ state P | adjoint P | a | values of one step | sums | kept states ]
//   action of the table   store or restore a state: copies; advance: one step of the primal;
//                         record: a step that notes the values which its partials need;
//                         adjoint: the same step backward, as on a tape
// The size of the program does not depend on the number of steps; the table has one row an action.
//
// What a step contributes to others is added up inside: where the place that it read does not
// depend on time, one sum for each iteration of a step is kept, so that parameters and images
// without a time axis cost no memory for each step. Otherwise one value an iteration is kept; then
// the gradient itself has a time axis.
#pragma once

#include "autodiff/updates/update_context.h"

namespace retrograde::autodiff {

// Whether the update is a loop over time whose values are lost, and a budget was given.
bool wants_checkpoints(const UpdateContext& context);
// Throws when the budget has no room for one state, is in bytes while a state's size is known at
// run time only, or makes a known number of steps need too long a table. A number of steps that is
// known at run time only is no obstacle: the pipeline makes its table then (checkpoint_actions.h).
void differentiate_by_checkpoints(const UpdateContext& context, UpdateAdjoint& result);

}  // namespace retrograde::autodiff
