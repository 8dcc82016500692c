// inline_calls.h -- inlines other Funcs into one definition.
#pragma once

#include <vector>

#include "graph/directives/give_directive.h"

namespace retrograde::graph {

// Replaces the calls of these Funcs in the stage's definition, including calls between them.
// Requires: an inlined Func has one pure definition; an inlined Func has no schedule of its own.
void inline_into(const SchedulePlace& stage, const std::vector<FuncPtr>& inlined);

}  // namespace retrograde::graph
