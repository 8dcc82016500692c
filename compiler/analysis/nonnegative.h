// Finds floats that are never below zero but may be NaN: abs(a), sqrt(a), a * a, and sums, products
// and minima of such. Intervals cannot express this, because their ends imply "not NaN".
#pragma once

#include "ir/expr.h"

namespace retrograde::analysis {

// False means unknown. Linear in the number of nodes of `e`.
bool is_nonnegative_or_nan(const Expr& e);

}  // namespace retrograde::analysis
