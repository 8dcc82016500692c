// Whether an expression reads memory: a store or a loop in between may change its value.
#pragma once

#include "ir/expr.h"

namespace retrograde::ir {

// What counts; each counts what stands before it, too.
enum class MemoryReads : uint8_t {
  Loads,      // of flat storage
  Storage,    // Funcs and images, before they are loads
  Functions,  // calls of C functions, which may read anything
  Calls,      // every call: operators may have effects
};
bool reads_memory(const Expr& e, MemoryReads what);

// Whether it calls the Func, or reads the image. Undefined: no.
bool calls(const Expr& e, const Symbol* f);

}  // namespace retrograde::ir
