// join_indices -- a quotient and its remainder that make up an index together are one again.
#pragma once

#include "ir/expr.h"

namespace retrograde::ir {

// FlatStorage, before vectorization -> the same phase.
Stmt join_indices(const Stmt& s);

}  // namespace retrograde::ir
