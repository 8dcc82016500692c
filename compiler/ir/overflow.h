// overflow.h -- detects integer overflow in constant arithmetic.
//
// Int(32) and Int(64) never overflow in the language. The operators on Expr leave constant sums,
// differences and products that would overflow unfolded, so that a definition can be rejected for
// them.
#pragma once

#include "ir/expr.h"

namespace retrograde::ir {

// a + b, a - b or a * b, folded unless that overflows. Operands must have one type.
Expr arithmetic(Kind kind, Expr a, Expr b);

// A subexpression of `root` that overflows for all values of its variables; undefined when there is
// none.
Expr overflowing_part(const Expr& root);

}  // namespace retrograde::ir
