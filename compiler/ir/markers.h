// Expressions without calls that only say something of their first argument.
#pragma once

#include "ir/expr.h"

namespace retrograde::ir {

Expr without_likely(const Expr& e);  // likely, likely_if_innermost
Stmt without_likely(const Stmt& s);
Expr without_promises(const Expr& e);  // promise_clamped
// Nor those of the user: of an expression at a place that they do not speak of.
Expr without_any_promises(const Expr& e);

}  // namespace retrograde::ir
