// stable_quotients.h -- derivatives of quotients 0 / 0: sin(x) / x, (exp(x) - 1) / x, log(1 + x) / x.
//
// Both terms vanish at the same point. The forms with -x, and the reciprocals of the last two, count as well. Near that
// point the derivative is a difference that cancels, so it is evaluated by a series there.
#pragma once

#include "autodiff/rules/stable_forms.h"
#include "ir/expr.h"

namespace retrograde::autodiff {

// The stable form of `e`, whose node is `quotient`.
StableForm quotient_form(const Expr& e, const Div& quotient);

}  // namespace retrograde::autodiff
