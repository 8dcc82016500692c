// large_bodies.h -- Funcs that inlining would copy without end.
//
// An unscheduled Func is inlined: that is what its user expects, and of a chain of Funcs
// each of which reads the one before at k places it makes k^n copies of the first. A pyramid of
// five levels is enough for a body that no code generator finishes. So there is a bound on what is
// copied, above anything that is worth computing again: what is larger, and read at more than one
// place, is computed at root.
#pragma once

#include <vector>

#include "graph/function.h"

namespace retrograde::transform {

// Which, beside those that are `stored` anyway: untouched, with bounds that are known without
// running, no loops around them.
std::vector<FuncPtr> large_bodies(const std::vector<FuncPtr>& outputs,
                                  const std::vector<FuncPtr>& stored);

}  // namespace retrograde::transform
