// Whether an expression reads memory, so that a store or loop in between may change its value.
#pragma once

#include "ir/expr.h"

namespace retrograde::ir {

// Kinds of memory reads. Each enumerator includes those before it.
enum class MemoryReads : uint8_t {
  Loads,      // Load nodes, in flat storage
  Storage,    // calls of Funcs and images, before they become loads
  Functions,  // calls of C functions, which may read any memory
  Calls,      // every call: operators may have effects
};
bool reads_memory(const Expr& e, MemoryReads what);

// Whether `e` calls the Func or reads the image; false when `e` is undefined.
bool calls(const Expr& e, const Symbol* f);

}  // namespace retrograde::ir
