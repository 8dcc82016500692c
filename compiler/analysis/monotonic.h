// monotonic -- decides whether an integer expression only increases or only decreases with one
// variable.
//
//   in y:  min(likely(y * 8), n - 8) + 7  increasing     n - y  decreasing     y % 4  unknown
//
// A constant result means that the value does not depend on the variable. The analysis is sound,
// but an expression with the result unknown may still be monotonic.
#pragma once

#include <string>

#include "ir/expr.h"

namespace retrograde::analysis {

enum class Monotonic : uint8_t { Constant, Increasing, Decreasing, Unknown };

Monotonic monotonic(const Expr& e, const std::string& variable);

}  // namespace retrograde::analysis
