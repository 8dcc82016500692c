// monotonic -- does an integer expression only grow, or only shrink, as one variable grows?
//
//   in y:  min(likely(y * 8), n - 8) + 7  increasing     n - y  decreasing     y % 4  unknown
//
// What is constant does not mention the variable. Sound; an unknown may be monotone all the same.
#pragma once

#include <string>

#include "ir/expr.h"

namespace retrograde::analysis {

enum class Monotonic : uint8_t { Constant, Increasing, Decreasing, Unknown };

Monotonic monotonic(const Expr& e, const std::string& variable);

}  // namespace retrograde::analysis
