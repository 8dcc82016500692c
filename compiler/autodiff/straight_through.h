// straight_through.h -- one function's value with another's derivative.
#pragma once

#include "ir/expr.h"

namespace retrograde {

// The value of `value`, exactly, and the derivative of `surrogate`, in both modes: for steps whose
// true derivative is 0. straight_through(round(x), x) rounds, and passes gradients as if it did
// not. `surrogate` must be finite.
// Requires: the value and its surrogate are floats of one type.
Expr straight_through(const Expr& value, const Expr& surrogate);

}  // namespace retrograde
