// Shapes of expressions that several stable forms look for.
#pragma once

#include <vector>

#include "autodiff/rules/derivative_rules.h"
#include "ir/expr.h"

namespace retrograde::autodiff {

// e, or what it is the negation of.
Expr without_sign(const Expr& e);
// 1 where w is x, -1 where it is -x, 0 where it is neither.
double sign_between(const Expr& w, const Expr& x);

// The terms of a sum; empty when there are more than four: longer ones are reductions.
std::vector<Expr> terms_of(const Expr& sum);

struct SignedTerm {
  Expr value;
  double sign = 1;
};
// The same through differences.
std::vector<SignedTerm> signed_terms_of(const Expr& sum);

}  // namespace retrograde::autodiff
