// Quotients of two terms that are 0 at the same place: sin(x) / x, (exp(x) - 1) / x, log(1 + x) / x
// with either sign of x, and the reciprocals of the last two. Their derivative is a difference that
// cancels there; near it they are differentiated by a series.
#pragma once

#include "autodiff/rules/stable_forms.h"
#include "ir/expr.h"

namespace retrograde::autodiff {

// Of e, which is the quotient.
StableForm quotient_form(const Expr& e, const Div& quotient);

}  // namespace retrograde::autodiff
