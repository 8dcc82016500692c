// Removes the markers of an expression: calls that return their first argument and only attach a
// hint or a promise to it.
#pragma once

#include "ir/expr.h"

namespace retrograde::ir {

Expr without_likely(const Expr& e);  // likely, likely_if_innermost
Stmt without_likely(const Stmt& s);
Expr without_promises(const Expr& e);  // promise_clamped
// Also removes unsafe_promise_clamped, the user's promise: for an expression that moves to a place
// where the promise need not hold.
Expr without_any_promises(const Expr& e);

}  // namespace retrograde::ir
