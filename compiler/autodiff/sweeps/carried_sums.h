// Sums that an adjoint carries from element to element, in double.
//
// The adjoint of a scan is a scan in the opposite order: that of a prefix sum is a suffix sum,
//   A(i) += A(i + 1),
// and a carried float32 loses up to half a unit at each of n additions: 12 million times 0.1 is
// wrong by a tenth. So where many terms may be carried, and no constant factor below 1 forgets
// them, a Func of its own, f_adj_carried, runs the scan in double, and f_adj rounds each element
// once. Terms are linear in what is carried; they are rewritten to multiply and add in double.
#pragma once

#include <optional>

#include "autodiff/updates/update_context.h"

namespace retrograde::autodiff {

// Elements from which sums are carried in double: fewer in float32 are wrong by at most 4e-6 of the
// sum of absolute values, n * 2^-24.
inline constexpr int many_carried = 64;

// The factor by which `term`, linear in calls of `carried`, may grow what is carried, as a bound of
// its absolute value; nullopt: not constant.
std::optional<double> carried_factor(const Expr& term, const FuncContents* carried);
// Whether the terms of one element together keep what many elements before gave.
bool carries_sums(const std::vector<Expr>& terms, const FuncContents* carried);

// `term`, linear in calls of `rounded`, in double, of calls of `exact` instead, where `rounded`
// rounds `exact`.
Expr carried_in_double(const Expr& term, const FuncPtr& rounded, const FuncPtr& exact);

}  // namespace retrograde::autodiff
