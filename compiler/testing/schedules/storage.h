// storage.h -- random directives for the storage of a Func and for the promised bounds of an output.
#pragma once

#include "testing/schedules/draft.h"
#include "testing/schedules/nesting.h"

namespace retrograde::fuzz {

// Draws where and how the values of a Func that is not inlined are stored. Funcs that share loops are neither memoized
// nor asynchronous.
void choose_storage(Draft& draft, int f, const Placement& placement, bool is_shared);

// Promises about an output hold for each of its regions.
void choose_output_rules(Draft& draft, int f);

}  // namespace retrograde::fuzz
