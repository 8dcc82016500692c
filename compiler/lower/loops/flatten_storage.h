// flatten_storage -- replace accesses of Funcs and images by accesses of flat allocations and buffers.
#pragma once

#include "ir/expr.h"

namespace retrograde::lower {

// Loops -> FlatStorage. Names afterwards:
//   Realize of "f"           Allocate "f". "f.min.d" and, for all but the innermost dimension, "f.stride.d" are bound
//                            around its body unless they are constants; "f.extent.d" if the body mentions it
//   Realize of a Tuple "f"   Allocate "f.0", "f.1", ..., which share "f.min.d" and "f.stride.d"
//   Func without a Realize   an output: buffer "f" ("f.0", ... if it has several values), for which the caller binds
//                            "<buffer>.min.d" and "<buffer>.stride.d"
//   image "in"               buffer "in", likewise
Stmt flatten_storage(const Stmt& s);

}  // namespace retrograde::lower
