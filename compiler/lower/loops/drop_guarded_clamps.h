// drop_guarded_clamps -- what a condition says already is not said again where it holds.
#pragma once

#include "ir/expr.h"

namespace retrograde::ir {

// Loops or FlatStorage, before vectorization -> the same phase.
Stmt drop_guarded_clamps(const Stmt& s);

}  // namespace retrograde::ir
