// What is known of the operators that vectors are reduced by.
#pragma once

#include "ir/expr.h"

namespace retrograde::lower {

// x op identity == x, bit for bit; a broadcast when the type has lanes.
Expr identity_of(Kind op, Type type);

}  // namespace retrograde::lower
