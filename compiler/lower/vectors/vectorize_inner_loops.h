// vectorize_inner_loops -- lanes for innermost loops that no schedule says anything about.
#pragma once

#include <functional>

#include "ir/expr.h"

namespace retrograde::lower {

struct InnerLoops {
  int vector_bytes = 32;
  // Whether the iterations of a loop touch different elements of what they store, so that they may
  // run in any order.
  std::function<bool(const For&)> is_independent;
};

// FlatStorage, after unrolling -> FlatStorage.
Stmt vectorize_inner_loops(const Stmt& s, const InnerLoops& loops);

}  // namespace retrograde::lower
