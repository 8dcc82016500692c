// Stable forms: shapes of expressions whose partials, taken operator by operator, cancel, overflow
// or underflow where the derivative of the whole does not. They are differentiated in one step.
//
// Logistic, s / (1 + exp(w)): exp(w) overflows where the value has long been 0, and so for s = 1.
// Shares, a / (a + b + ...), a / (1 + |a|), exp(a) / (exp(a) + exp(b) + ...): softmax. The
// difference of 1 / S and v / S cancels. So it does in ratios of sums of the same terms:
// (a - b) / (a + b), tanh as (exp(a) - exp(-a)) / (exp(a) + exp(-a)), (1 - a * a) / (1 + a * a).
// Softplus, log-sum-exp, log(exp(a) + exp(b) + c): the reciprocal of a tiny sum is infinite.
// The same by max(a, b) + log(1 + exp(-|a - b|)), also in a sum: both parts have a kink at a = b.
// Logarithm of a quotient, log(a / b): the quotient may be denormal, and its reciprocal infinite.
// Angle, atan(a / b): the quotient's square overflows.
// Sums in which a term cancels, a - a + b: an infinite adjoint would reach a as inf - inf.
// Entropy, a log(a), and a log(a / b): 1 / a overflows where a is denormal.
// Norms and what is divided by them: stable_norms.h. sin(a) / a and its kin: stable_quotients.h.
//
// Forms overlap on shared nodes. A sweep takes the outermost one first: at each node that an adjoint
// reaches, the form of that node or, where it has none, its operator. What a form passes over keeps
// the adjoints that reach it from elsewhere. A form is taken where all of its equalities hold
// between the nodes themselves (equal.h); test/gradient/forms looks for what is not so.
//
// Source: folklore; Higham, Accuracy and Stability of Numerical Algorithms, 2nd ed., 1.14 and 27.8.
#pragma once

#include <vector>

#include "autodiff/rules/derivative_rules.h"
#include "ir/expr.h"

namespace retrograde::autodiff {

struct StableForm {
  std::vector<Expr> operands;  // inner expressions; empty: `e` has none of the shapes
  std::vector<Partial> partials;

  bool is_found() const { return !operands.empty(); }
  void add(const Expr& operand, const Partial& partial) {
    operands.push_back(operand);
    partials.push_back(partial);
  }
};
StableForm stable_form(const Expr& e);

}  // namespace retrograde::autodiff
