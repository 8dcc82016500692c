// flatten_storage -- replace accesses of Funcs and images by accesses of flat allocations and buffers.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "ir/expr.h"

namespace retrograde::lower {

// How the storage of a Func is laid out. If vectors are empty, dimension 0 is innermost and nothing is folded.
struct StorageLayout {
  std::vector<int> order;   // dimensions, innermost first
  std::vector<Expr> folds;  // per dimension: the fold factor; undefined: not folded
  std::string
      lies_in;  // the hoisted storage that holds it, by its name before renaming; empty: its own memory
  std::string is_place;  // of hoisted storage: its name before renaming
  // The last bound of its Realize is not a dimension: its minimum is the first element in the hoisted storage.
  bool is_in_ring = false;
};
using StorageLayouts =
    std::map<std::string, StorageLayout>;  // by Func; if missing, the default layout

// Loops -> FlatStorage. Names afterwards:
//   Realize of "f"           Allocate "f". "f.min.d" and, for all but the innermost dimension, "f.stride.d" are bound
//                            around its body unless they are constants; "f.extent.d" if the body mentions it
//   Realize of a Tuple "f"   Allocate "f.0", "f.1", ..., which share "f.min.d" and "f.stride.d"
//   Func without a Realize   an output: buffer "f" ("f.0", ... if it has several values), for which the caller binds
//                            "<buffer>.min.d" and "<buffer>.stride.d"
//   image "in"               buffer "in", likewise
Stmt flatten_storage(const Stmt& s, const StorageLayouts& layouts = {});

}  // namespace retrograde::lower
