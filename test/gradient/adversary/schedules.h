// Schedules for the Funcs of a gradient: what an author may write, at random.
#pragma once

#include <vector>

#include "frontend/language/func.h"

namespace retrograde::gradient {

// Levels, loops and storage of each Func; directives that are refused are left out. Values do not
// change but by rounding. The last Func is an output.
void schedule_at_random(const std::vector<Func>& funcs, uint64_t seed);

}  // namespace retrograde::gradient
