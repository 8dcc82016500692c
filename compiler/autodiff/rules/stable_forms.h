// stable_forms.h -- expressions that are differentiated as a whole, because operator by operator they lose accuracy.
//
// For each form below, the partials of the single operators cancel, overflow or underflow where the derivative of the
// whole expression does not.
//
// Logistic, s / (1 + exp(w)): exp(w) overflows where the value has long been 0, also for s = 1.
// Shares, a / (a + b + ...), a / (1 + |a|), exp(a) / (exp(a) + exp(b) + ...) (softmax): the difference of 1 / S and
//   v / S cancels. The same holds for ratios of sums of equal terms: (a - b) / (a + b),
//   tanh as (exp(a) - exp(-a)) / (exp(a) + exp(-a)), (1 - a * a) / (1 + a * a).
// Softplus, log-sum-exp, log(exp(a) + exp(b) + c): the reciprocal of a tiny sum is infinite.
//   Also as max(a, b) + log(1 + exp(-|a - b|)), alone or in a sum: both parts have a kink at a = b.
// Logarithm of a quotient, log(a / b): the quotient may be denormal, and its reciprocal infinite.
// Angle, atan(a / b): the square of the quotient overflows.
// Sums with a term that cancels, a - a + b: an infinite adjoint would reach a as inf - inf.
// Entropy, a log(a) and a log(a / b): 1 / a overflows where a is denormal.
// Norms, and expressions divided by norms: stable_norms.h. sin(a) / a and similar quotients: stable_quotients.h.
//
// Forms overlap on shared nodes. A sweep takes the outermost form first: at each node that an adjoint reaches it uses
// the node's form if there is one, else its operator. Nodes inside a form keep the adjoints that reach them from
// elsewhere. A form applies only if all its equalities hold between the nodes themselves (equal.h). The tests in
// test/gradient/forms search for false matches.
//
// Source: folklore; Higham, Accuracy and Stability of Numerical Algorithms, 2nd ed., 1.14 and 27.8.
#pragma once

#include <vector>

#include "autodiff/rules/derivative_rules.h"
#include "ir/expr.h"

namespace retrograde::autodiff {

struct StableForm {
  std::vector<Expr> operands;  // inner expressions; empty if the expression has no stable form
  std::vector<Partial> partials;

  bool is_found() const { return !operands.empty(); }
  void add(const Expr& operand, const Partial& partial) {
    operands.push_back(operand);
    partials.push_back(partial);
  }
};
StableForm stable_form(const Expr& e);

}  // namespace retrograde::autodiff
