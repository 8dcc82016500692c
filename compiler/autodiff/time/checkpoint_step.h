// checkpoint_step.h -- one iteration of a step of a checkpointed loop, forward and backward, as writes into slots.
#pragma once

#include <vector>

#include "autodiff/time/checkpoint_slots.h"

namespace retrograde::autodiff {

// Forward: stores the values that are needed later; the last write is the step's own.
std::vector<SlotWrite> record_writes(const UpdateContext& context, const CheckpointPlan& plan,
                                     const CheckpointSlots& slots);
// Backward: a = A[W]; A[W] = 0; A[R_k] += a dV/dv_k; then the contributions to others.
std::vector<SlotWrite> adjoint_writes(const UpdateContext& context, const CheckpointPlan& plan,
                                      const CheckpointSlots& slots);

}  // namespace retrograde::autodiff
