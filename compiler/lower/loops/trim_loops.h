// trim_loops -- a condition that holds in one stretch of a loop becomes the ends of the loop.
#pragma once

#include "ir/expr.h"

namespace retrograde::ir {

// Loops or FlatStorage, before vectorization -> the same phase.
Stmt trim_loops(const Stmt& s);

}  // namespace retrograde::ir
