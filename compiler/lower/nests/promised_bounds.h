// What users promise or want of the region of a Func.
#pragma once

#include <vector>

#include "analysis/interval.h"
#include "lower/program.h"

namespace retrograde::lower {

// Func::bound: the loops cover exactly what was promised; a check makes sure that it is enough.
// Func::align_bounds and align_extent: they cover more.
void apply_promised_bounds(const LoopedFunc& f, Box& box, std::vector<Stmt>& checks);

}  // namespace retrograde::lower
