// carried_sums.h -- runs the adjoint of a scan in double if it carries a long sum from element to element.
//
// The adjoint of a scan is a scan in the opposite order; that of a prefix sum is a suffix sum,
//   A(i) += A(i + 1).
// A carried float32 loses up to half a unit in the last place at each of n additions: the sum of 12 million times 0.1
// is wrong by a tenth. If many terms may be carried, and no constant factor below 1 damps them, a Func f_adj_carried
// runs the scan in double, and f_adj rounds each element once. The terms are linear in the carried value; they are
// rewritten to multiply and add in double.
#pragma once

#include <optional>

#include "autodiff/updates/update_context.h"

namespace retrograde::autodiff {

// Scans over at least this many elements carry double. Shorter ones in float32 are wrong by at most n * 2^-24 = 4e-6 of
// the sum of absolute values.
inline constexpr int many_carried = 64;

// An upper bound of the absolute factor by which `term`, linear in calls of `carried`, multiplies the carried value;
// nullopt if the factor is not constant.
std::optional<double> carried_factor(const Expr& term, const FuncContents* carried);
// Whether the terms of one element together keep the contributions of many earlier elements.
bool carries_sums(const std::vector<Expr>& terms, const FuncContents* carried);

// Rewrites `term`, linear in calls of `rounded`, to double precision: it calls `exact`, whose rounded values `rounded`
// holds.
Expr carried_in_double(const Expr& term, const FuncPtr& rounded, const FuncPtr& exact);

}  // namespace retrograde::autodiff
