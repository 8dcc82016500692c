// What is known of the operators that vectors are reduced by.
#pragma once

#include "ir/expr.h"

namespace retrograde::ir {

// Add, Mul, Min, Max, And, Or.
ReduceOp reduce_op(Kind kind);
// x op identity == x, bit for bit; a broadcast when the type has lanes.
Expr identity_of(ReduceOp op, Type type);

}  // namespace retrograde::ir
