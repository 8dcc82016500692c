// Structural equality, order and hash of expressions and statements, and equality up to names. Shared nodes are
// compared once; Symbols compare by name.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <unordered_map>

#include "ir/expr.h"

namespace retrograde::ir {
bool equal(const Expr& a, const Expr& b);
bool equal(const Stmt& a, const Stmt& b);
int compare(const Expr& a, const Expr& b);  // a total order: negative, 0 or positive
size_t hash(const Expr& e);
// Names of one statement, each with the name that stands for it in another one. No two have the same.
using Renaming = std::unordered_map<std::string, std::string>;
// The names of `a` and those of `b` if the statements are equal up to the names of variables, loops and memory, given
// that `known` names stand for each other; nullopt if they are not. A Launch equals no other one.
std::optional<Renaming> renaming(const Stmt& a, const Stmt& b, const Renaming& known = {});
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
