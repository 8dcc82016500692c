// keep_accumulators -- keep the elements that a reduction updates in registers while its loops run.
#pragma once

#include <functional>

#include "ir/expr.h"

namespace retrograde::lower {

// Loops to Loops. `is_pure`: whether the iterations of a loop store to different elements.
Stmt keep_accumulators(const Stmt& s, const std::function<bool(const For&)>& is_pure);

}  // namespace retrograde::lower
