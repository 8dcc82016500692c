// straight_through.h -- an expression with the value of one function and the derivative of another.
#pragma once

#include "ir/expr.h"

namespace retrograde {

// Returns exactly `value`, with the derivative of `surrogate` in both modes: for step functions, whose derivative is 0.
// straight_through(round(x), x) rounds, and passes gradients as if it did not. `surrogate` must be finite.
// Requires: the value and its surrogate are floats of one type.
Expr straight_through(const Expr& value, const Expr& surrogate);

}  // namespace retrograde
