// carry_elements -- keep the elements that a scan reads of its last iterations in registers.
#pragma once

#include <functional>

#include "ir/expr.h"

namespace retrograde::lower {

// FlatStorage to FlatStorage, before unrolling. `is_pure`: whether the iterations of a loop store to different elements.
Stmt carry_elements(const Stmt& s, const std::function<bool(const For&)>& is_pure);

}  // namespace retrograde::lower
