// stable_patterns.h -- matchers of expression shapes that several stable forms share.
#pragma once

#include <vector>

#include "autodiff/rules/derivative_rules.h"
#include "ir/expr.h"

namespace retrograde::autodiff {

// e without its negation, if it has one.
Expr without_sign(const Expr& e);
// 1 if w is x, -1 if w is -x, else 0.
double sign_between(const Expr& w, const Expr& x);

// The terms of a sum; empty if there are more than four, because longer sums are reductions.
std::vector<Expr> terms_of(const Expr& sum);

struct SignedTerm {
  Expr value;
  double sign = 1;
};
// As terms_of, but differences count as sums, too.
std::vector<SignedTerm> signed_terms_of(const Expr& sum);

}  // namespace retrograde::autodiff
