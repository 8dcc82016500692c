// Structural equality, order and hash. DAG-aware: shared nodes are compared once. Symbols compare
// by name.
#pragma once

#include <cstddef>

#include "ir/expr.h"

namespace retrograde::ir {
bool equal(const Expr& a, const Expr& b);
bool equal(const Stmt& a, const Stmt& b);
int compare(const Expr& a, const Expr& b);  // a total order: < 0, 0, > 0
size_t hash(const Expr& e);
struct StructuralLess {
  bool operator()(const Expr& a, const Expr& b) const { return compare(a, b) < 0; }
};
// For unordered containers keyed by value.
struct StructuralHash {
  size_t operator()(const Expr& e) const { return hash(e); }
};
struct StructuralEqual {
  bool operator()(const Expr& a, const Expr& b) const { return equal(a, b); }
};
}  // namespace retrograde::ir
