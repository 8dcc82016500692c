// isl_budget.h -- the budget of isl operations.
#pragma once

namespace retrograde::autodiff {

// The budget of one context; exceeding it throws isl::exception_quota. A million operations take about a second.
inline constexpr unsigned long isl_operations = 20'000'000;

}  // namespace retrograde::autodiff
