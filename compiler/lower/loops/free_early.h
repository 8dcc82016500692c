// free_early -- end the life of an allocation right after its last use.
#pragma once

#include "ir/expr.h"

namespace retrograde::ir {

// FlatStorage or Vector -> the same phase, with a Free in every Allocate whose storage is used.
Stmt free_early(const Stmt& s);

}  // namespace retrograde::ir
