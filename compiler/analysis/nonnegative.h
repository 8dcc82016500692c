// Floats that are never below zero, though they may be NaN: what an interval, whose ends say "not
// NaN" as well, cannot tell. abs(a), sqrt(a), a * a, and sums, products and minima of such.
#pragma once

#include "ir/expr.h"

namespace retrograde::analysis {

// False means unknown. Linear in the nodes of `e`.
bool is_nonnegative_or_nan(const Expr& e);

}  // namespace retrograde::analysis
