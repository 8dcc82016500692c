// Funcs that cancel: the output reads them, and does not change with them.
//
//   softmax      e(x, y) = exp(a(x, y) - m(y))   s(y) = sum of e(x, y)   p(x, y) = e(x, y) / s(y)
//   log-sum-exp  m(y) + log(s(y))
//   norms        m(y) * sqrt(sum of (a(x, y) / m(y))^2)
//
// p is the same for every m. Its adjoint is therefore exactly 0; summed path by path it is what
// rounding leaves of a cancellation, and the element where m, a maximum, was found would get that.
//
// Method: homogeneity. Let m(y) become m(y) + d(y), or m(y) * exp(d(y)), for any small d. Whoever
// reads m responds by
//   Shifted  v + c d(place)        Scaled  v * exp(c d(place))        Fixed  v
// with a constant degree c; sums, products, powers, exp and log turn one into another, a sum over x
// keeps what all its terms have in common. What becomes anything else is Unknown. If every value of
// the output is Fixed, the derivative by m is 0 wherever it exists. As in derivatives, integers and
// conditions count as constants, and so does stop_gradient.
//
// Cost: one walk for each Func of fewer dimensions than the stage that subtracts it, or divides by
// it, over what depends on it, until the first Unknown.
#pragma once

#include <unordered_set>
#include <vector>

#include "graph/function.h"

namespace retrograde::autodiff {

// Of `order`, producers before consumers, the output last: Funcs that cancel.
std::unordered_set<const Symbol*> cancelling_funcs(const std::vector<FuncPtr>& order);

}  // namespace retrograde::autodiff
