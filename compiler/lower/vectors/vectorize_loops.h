// vectorize_loops -- turn the iterations of Vectorized loops into lanes of vectors.
#pragma once

#include "ir/expr.h"

namespace retrograde::ir {

// FlatStorage -> FlatStorage without Vectorized loops. UserError when the extent of such a loop is
// not a constant.
Stmt vectorize_loops(const Stmt& s);

}  // namespace retrograde::ir
