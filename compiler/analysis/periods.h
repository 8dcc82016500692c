// periods.h -- by how much a variable may grow before the quotients and remainders of index expressions repeat.
//
// (x + r) / 2 grows by one, and (x + r) % 2 stays, whenever x grows by 2: their period in x is 2. A loop over x that is
// split by the period has iterations of one phase each, in which no division contains the outer loop's variable.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "ir/expr.h"

namespace retrograde::analysis {

// Longer periods count as none.
inline constexpr int64_t longest_period = 4096;

// The smallest period of all integer divisions and remainders in e that contain the variable; 1 if there are none, 0 if
// one of them has no period.
int64_t period_in(const Expr& e, const std::string& variable);

// By how much e grows whenever the variable grows by `period`; nullopt if that differs from place to place.
std::optional<int64_t> growth_over(const Expr& e, const std::string& variable, int64_t period);

}  // namespace retrograde::analysis
