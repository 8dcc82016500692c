// invariance.h -- finds Funcs that cancel: the output reads them, but its value does not depend on them.
//
//   softmax      e(x, y) = exp(a(x, y) - m(y))   s(y) = sum of e(x, y)   p(x, y) = e(x, y) / s(y)
//   log-sum-exp  m(y) + log(s(y))
//   norms        m(y) * sqrt(sum of (a(x, y) / m(y))^2)
//
// p is the same for every m, so the adjoint of m is exactly 0. Summed path by path it would be the rounding error of a
// cancellation, and the element that attains the maximum m would receive that error.
//
// Method: homogeneity. Replace m(y) by m(y) + d(y), or by m(y) * exp(d(y)), for any small d. A value v that reads m
// then responds in one of these ways, with a constant degree c:
//
//   Shifted  v + c d(place)        Scaled  v * exp(c d(place))        Fixed  v
//
// Sums, products, powers, exp and log turn one response into another. A sum over x keeps the response that all its
// terms share. Every other response is Unknown. If every value of every output is Fixed, the derivative by m is
// 0 wherever it exists. As in derivatives, integers, conditions and stop_gradient count as constants.
//
// Cost: one walk for each Func that a stage of more dimensions subtracts or divides by. The walk covers the Funcs that
// depend on it and stops at the first Unknown.
#pragma once

#include <unordered_set>
#include <vector>

#include "graph/function.h"

namespace retrograde::autodiff {

// Returns the Funcs of `order` that cancel in all outputs. `order` has producers before consumers.
std::unordered_set<const Symbol*> cancelling_funcs(const std::vector<FuncPtr>& order,
                                                   const std::vector<FuncPtr>& outputs);

}  // namespace retrograde::autodiff
