// flatten_storage -- replace points of Funcs and images by elements of flat allocations and
// buffers.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "ir/expr.h"

namespace retrograde::lower {

// How the storage of a Func is laid out. Empty vectors: dimension 0 innermost, nothing wraps
// around.
struct StorageLayout {
  std::vector<int> order;   // dimensions, innermost first
  std::vector<Expr> folds;  // per dimension: coordinates modulo this; undefined: as they are
  std::string lies_in;   // the place around, by its name before renaming; empty: memory of its own
  std::string is_place;  // of a place: its name before renaming
  // The last bound of its Realize is no dimension, but the element that it begins with.
  bool is_in_ring = false;
};
using StorageLayouts = std::map<std::string, StorageLayout>;  // by Func; a missing one is plain

// Loops -> FlatStorage. Names afterwards:
//   Realize of "f"           Allocate "f". "f.min.d" and, for all but the innermost dimension,
//                            "f.stride.d" are bound around its body where they are no constants;
//                            "f.extent.d" where the body mentions it
//   Realize of a Tuple "f"   Allocate "f.0", "f.1", ..., which share "f.min.d" and "f.stride.d"
//   Func without a Realize   an output: buffer "f" ("f.0", ... when it has several values), whose
//                            facts "<buffer>.min.d" and "<buffer>.stride.d" the caller binds
//   image "in"               the same: buffer "in"
Stmt flatten_storage(const Stmt& s, const StorageLayouts& layouts = {});

}  // namespace retrograde::lower
