// What targets ask for to find faults: promises that are checked, results that show which of them
// depend on the last bit.
#pragma once

#include "ir/expr.h"

namespace retrograde::ir {

// Target::CheckUnsafePromises: a call fails where a value breaks its unsafe_promise_clamped().
Stmt check_promises(const Stmt& s);
// Target::FuzzFloatStores: the last bit of every stored float is 0.
Stmt fuzz_float_stores(const Stmt& s);

}  // namespace retrograde::ir
