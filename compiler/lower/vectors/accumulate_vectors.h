// Reductions of vectors combine lanes once after their loop, not in each iteration; see the .cpp.
#pragma once

#include "ir/expr.h"

namespace retrograde::ir {
Stmt accumulate_vectors(const Stmt& s);
}
