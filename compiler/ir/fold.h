// Constant folding: the value of a node over constants, and the identities that hold for all operands, such as
// x * 1 = x. Builders fold first and make a node only if the result is undefined.
#pragma once

#include <vector>

#include "ir/expr.h"

namespace retrograde::ir {

// `a` and `b` have one type; `result` is bool for comparisons.
Expr fold_binary(Kind kind, Type result, const Expr& a, const Expr& b);
// The types differ, but not in their number of lanes.
Expr fold_cast(Type type, const Expr& value);
// The types differ, but not in their number of bits.
Expr fold_reinterpret(Type type, const Expr& value);
// `op` is a pure operator; the arguments have as many lanes as `type`.
Expr fold_operator(Op op, Type type, const std::vector<Expr>& args);

}  // namespace retrograde::ir
