// recurrence.h -- adjoints of updates with known index sets: the analysis tells which iteration wrote the value that
// another one reads.
#pragma once

#include "autodiff/updates/update_context.h"

namespace retrograde::autodiff {

// Handles the shapes "overwriting" and "recurrence" of update.h: every index is quasi-affine, and no element is written
// twice, unless the update never reads its Func. Returns false and leaves `result` unchanged for any other update.
// Throws if a partial needs an overwritten value that may not be kept.
bool differentiate_recurrence(const UpdateContext& context, UpdateAdjoint& result);

}  // namespace retrograde::autodiff
