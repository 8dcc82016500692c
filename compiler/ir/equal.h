// Structural equality, order and hash of expressions and statements. Shared nodes are compared
// once; Symbols compare by name.
#pragma once

#include <cstddef>

#include "ir/expr.h"

namespace retrograde::ir {
bool equal(const Expr& a, const Expr& b);
bool equal(const Stmt& a, const Stmt& b);
int compare(const Expr& a, const Expr& b);  // a total order: negative, 0 or positive
size_t hash(const Expr& e);
struct StructuralLess {
  bool operator()(const Expr& a, const Expr& b) const { return compare(a, b) < 0; }
};
// Hash functor for unordered containers keyed by value.
struct StructuralHash {
  size_t operator()(const Expr& e) const { return hash(e); }
};
struct StructuralEqual {
  bool operator()(const Expr& a, const Expr& b) const { return equal(a, b); }
};
}  // namespace retrograde::ir
