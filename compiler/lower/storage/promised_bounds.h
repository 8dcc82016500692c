// Applies the directives bound, align_bounds and align_extent to the region of a Func.
#pragma once

#include <vector>

#include "analysis/interval.h"
#include "lower/program.h"

namespace retrograde::lower {

// Func::bound: the loops cover exactly the promised region; a run-time check ensures that it is large enough.
// Func::align_bounds and align_extent enlarge the region.
void apply_promised_bounds(const LoopedFunc& f, Box& box, std::vector<Stmt>& checks);

}  // namespace retrograde::lower
