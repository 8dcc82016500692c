// Expansion of the lets in an expression.
#pragma once

#include "ir/expr.h"

namespace retrograde::ir {

// Replaces every let variable by its value. The result is a DAG that keeps the sharing of the lets.
Expr without_lets(const Expr& e);

}  // namespace retrograde::ir
