// Vectors whose lanes follow a pattern are computed part by part and interleaved; see the .cpp.
#pragma once

#include "ir/expr.h"

namespace retrograde::ir {
Stmt interleave_vectors(const Stmt& s);
}
