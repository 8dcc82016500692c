// Stable forms: shapes of expressions whose partials, taken operator by operator, cancel, overflow
// or underflow where the derivative of the whole does not. They are differentiated in one step.
//
// Logistic, s / (1 + exp(w)): exp(w) overflows where the value has long been 0, and so for s = 1.
// Shares, a / (a + b + ...), a / (1 + |a|), exp(a) / (exp(a) + exp(b) + ...): softmax. The
// difference
//   of 1 / S and v / S cancels.
// Normalised, a / sqrt(a * a + b * b + ...), also by max(norm, c): the same.
// Softplus, log-sum-exp, log(exp(a) + exp(b) + c): the reciprocal of a tiny sum is infinite.
// Logarithm of a quotient, log(a / b): the quotient may be denormal, and its reciprocal infinite.
// Norm, sqrt(a * a + b * b + ...): the squares underflow where the norm is tiny.
//
// Source: folklore; Higham, Accuracy and Stability of Numerical Algorithms, 2nd ed., 1.14 and 27.8.
#pragma once

#include <vector>

#include "autodiff/derivative_rules.h"
#include "ir/expr.h"

namespace retrograde::ir {

struct StableForm {
  std::vector<Expr> operands;  // inner expressions; empty: `e` has none of the shapes
  std::vector<Partial> partials;
};
StableForm stable_form(const Expr& e);

// The components of (a_1, ..., a_n) / |(a_1, ..., a_n)|: 0 at the origin; NaN where a component is
// infinite or NaN, or the norm overflows; right to 3 ULP for denormal and huge vectors too.
std::vector<Expr> unit_vector(const std::vector<Expr>& a);

}  // namespace retrograde::ir
