// Strided loads that lie beside each other share the vectors they are picked from; see the .cpp.
#pragma once

#include "ir/expr.h"

namespace retrograde::ir {
Stmt deinterleave_loads(const Stmt& s);
}
