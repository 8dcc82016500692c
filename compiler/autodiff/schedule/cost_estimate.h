// What it costs to compute a value again, beside keeping it: for default schedules, and for Funcs
// that differentiation makes only where they pay.
#pragma once

#include "ir/expr.h"

namespace retrograde::ir {

// Operations up to which a value is computed again rather than stored.
inline constexpr double cheap = 6;
// What it takes to store a value and to load it again, in operations of a vectorized loop: 12 bytes
// at the bandwidth of a core, against an operation a lane and cycle.
inline constexpr double way_to_memory = 24;

// Operations of the node itself, without those of what it reads. Integers are indices and borders:
// mostly simplified away.
double operations_of(const Expr& node);

}  // namespace retrograde::ir
