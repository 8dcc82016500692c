// partition_loops -- split loops so that conditions marked likely() vanish from most of their
// iterations.
#pragma once

#include "ir/expr.h"

namespace retrograde::ir {

// Loops or FlatStorage, before vectorization -> the same phase, without likely and
// likely_if_innermost markers.
Stmt partition_loops(const Stmt& s);

}  // namespace retrograde::ir
