// One iteration of a step of a checkpointed loop, forward and backward, as writes into its slots.
#pragma once

#include <vector>

#include "autodiff/time/checkpoint_slots.h"

namespace retrograde::autodiff {

// Forward: the values that are needed later are noted; the last one is the step's own write.
std::vector<SlotWrite> record_writes(const UpdateContext& context, const CheckpointPlan& plan,
                                     const CheckpointSlots& slots);
// Backward: a = A[W]; A[W] = 0; A[R_k] += a dV/dv_k; then what others get.
std::vector<SlotWrite> adjoint_writes(const UpdateContext& context, const CheckpointPlan& plan,
                                      const CheckpointSlots& slots);

}  // namespace retrograde::autodiff
