// unroll_loops -- copy the body of every Unrolled loop once per iteration.
#pragma once

#include "ir/expr.h"

namespace retrograde::ir {

// Any phase -> the same phase without Unrolled loops. UserError when the extent of such a loop is
// not a constant.
Stmt unroll_loops(const Stmt& s);

}  // namespace retrograde::ir
