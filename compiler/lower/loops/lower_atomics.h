// lower_atomics -- keep only what must be indivisible, and only where iterations may meet.
#pragma once

#include "ir/expr.h"

namespace retrograde::ir {

Stmt lower_atomics(const Stmt& s);

}  // namespace retrograde::ir
