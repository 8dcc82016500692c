// power_partials.h -- the partials of v = x^p, by pow or by its fast variant.
#pragma once

#include <vector>

#include "autodiff/rules/partial.h"

namespace retrograde::autodiff {

// `a` is {x, p}. dx = p x^(p-1), and 0 where p is 0. dp = x^p log x, and 0 where x is 0.
//
// If p - 1 is inexact, x^(p-1) is off by the rounding error times log x, or is a different power altogether. Then dx is
// p v / x, except where v overflowed or underflowed.
//
// Both expressions are built so that their own derivatives are right, too. Where p is 0, dx is p / x, whose derivative
// by p is 1 / x. Where x is 0, neither dx nor dp depends on p.
std::vector<Partial> power_partials(const std::vector<Expr>& a, const Expr& v, Op power,
                                    Op logarithm);

}  // namespace retrograde::autodiff
