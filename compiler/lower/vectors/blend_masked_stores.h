// Stores under a mask into storage of one's own write whole vectors; see the .cpp.
#pragma once

#include "ir/expr.h"

namespace retrograde::ir {
Stmt blend_masked_stores(const Stmt& s);
}
