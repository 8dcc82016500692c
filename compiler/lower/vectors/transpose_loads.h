// Strided loads of neighbouring statements that together read a block are read by rows; see the
// .cpp.
#pragma once

#include "ir/expr.h"

namespace retrograde::ir {
Stmt transpose_loads(const Stmt& s);
}
