// Work that isl may do.
#pragma once

namespace retrograde::autodiff {

// Operations in one context; beyond them, isl::exception_quota. A million take about a second.
inline constexpr unsigned long isl_operations = 20'000'000;

}  // namespace retrograde::autodiff
