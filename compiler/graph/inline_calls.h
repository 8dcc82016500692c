// inline_calls.h -- a definition with calls of other Funcs replaced by what these store.
#pragma once

#include <vector>

#include "graph/give_directive.h"

namespace retrograde::graph {

// Replaces the calls of these Funcs in the definition of the stage, those of one that another of
// them calls as well.
// Requires: what is inlined has one pure definition; what is inlined has no schedule of its own.
void inline_into(const SchedulePlace& stage, const std::vector<FuncPtr>& inlined);

}  // namespace retrograde::graph
