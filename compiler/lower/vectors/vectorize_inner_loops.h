// vectorize_inner_loops -- vectorizes innermost loops that have no scheduling directive.
#pragma once

#include <functional>

#include "ir/expr.h"

namespace retrograde::lower {

struct InnerLoops {
  int vector_bytes = 32;
  // Whether the iterations of a loop store to different elements, so that they may run in any order.
  std::function<bool(const For&)> is_independent;
};

// FlatStorage, after unrolling -> FlatStorage.
Stmt vectorize_inner_loops(const Stmt& s, const InnerLoops& loops);

}  // namespace retrograde::lower
