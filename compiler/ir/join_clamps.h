// Differences of clamps of one value.
#pragma once

#include <functional>

#include "ir/sum.h"

namespace retrograde::ir {

// clamp(x, 0, 2) - clamp(x, 1, 2)  is  clamp(x, 0, 1) - 1: two terms become one, or none, where the values that one of
// them lets pass are those of the other and some at one end. Ends are constants; min(x, 2) has one. `build` makes the
// minimum and the maximum of the new term. False: there is no such pair.
bool join_clamps(Sum& sum, const std::function<Expr(Kind, const Expr&, const Expr&)>& build);

}  // namespace retrograde::ir
