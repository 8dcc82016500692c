// overflow.h -- arithmetic of constants that overflows.
//
// Int(32) and Int(64) do not overflow in the language. Sums, differences and products of constants
// that would are not folded by the operators on Expr, so that a definition can be refused for them.
#pragma once

#include "ir/expr.h"

namespace retrograde::ir {

// a + b, a - b or a * b, folded unless it overflows. Operands of one type.
Expr arithmetic(Kind kind, Expr a, Expr b);

// A part of `root` that overflows, whatever the values of its variables; undefined when none does.
Expr overflowing_part(const Expr& root);

}  // namespace retrograde::ir
