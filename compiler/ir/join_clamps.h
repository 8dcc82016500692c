// Simplifies differences of two clamps of one value.
#pragma once

#include <functional>

#include "ir/sum.h"

namespace retrograde::ir {

// Merges two terms of the sum that clamp one value:
//
//   clamp(x, 0, 2) - clamp(x, 1, 2)  =>  clamp(x, 0, 1) - 1
//
// Two terms become one or none when one clamp's range extends the other's at one end only. The ends
// are constants; min(x, 2) counts as a clamp with one end. `build` makes the minimum and maximum of
// the new term. Returns false when there is no such pair.
bool join_clamps(Sum& sum, const std::function<Expr(Kind, const Expr&, const Expr&)>& build);

}  // namespace retrograde::ir
