// Expressions without their lets.
#pragma once

#include "ir/expr.h"

namespace retrograde::ir {

// Every let replaced by what it binds. The result shares what the lets shared.
Expr without_lets(const Expr& e);

}  // namespace retrograde::ir
