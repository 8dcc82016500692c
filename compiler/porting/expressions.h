// expressions.h -- Halide's helpers that build and inspect expressions: constants, simplification,
// substitution, and the node types with their visitors (ir/visitor.h).
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <type_traits>

#include "ir/build.h"
#include "ir/equal.h"
#include "ir/visitor.h"

namespace retrograde::porting {

#define RETROGRADE_EXPR(K) using ir::K;
#define RETROGRADE_BINARY(K) using ir::K;
#include "ir/kinds.def"
using ir::IRGraphMutator;
using ir::IRGraphVisitor;
using ir::IRMutator;
using ir::IRVisitor;

// ---- constants ----

// The value in the type, repeated for each lane; integers wrap.
template <typename T>
requires std::is_arithmetic_v<T> Expr make_const(Type type, T value) {
  if constexpr (std::is_floating_point_v<T>)
    return ir::make_const(type, static_cast<double>(value));
  else if constexpr (std::is_unsigned_v<T>)
    return ir::make_uint_const(type, value);
  else
    return ir::make_const(type, static_cast<int64_t>(value));
}
using ir::const_false;
using ir::const_true;
using ir::make_one;
using ir::make_zero;
inline Expr make_two(Type type) { return ir::make_const(type, 2); }
inline Expr make_bool(bool value, int lanes = 1) {
  return value ? ir::const_true(lanes) : ir::const_false(lanes);
}

// Whether `e` is an immediate, or a Broadcast of one.
using ir::is_const;
inline bool is_const(const Expr& e, int64_t value) {
  return e.defined() && ir::is_const_int(e, value);
}
inline bool is_const_zero(const Expr& e) { return e.defined() && ir::is_zero(e); }
inline bool is_const_one(const Expr& e) { return e.defined() && ir::is_one(e); }
bool is_positive_const(const Expr& e);
bool is_negative_const(const Expr& e);
std::optional<int> is_const_power_of_two_integer(const Expr& e);  // its exponent
// Nothing unless `e` is a constant of that kind. as_const_int takes unsigned constants that fit, too.
using ir::as_const_float;
using ir::as_const_int;
std::optional<uint64_t> as_const_uint(const Expr& e);

// ---- whole expressions ----

using ir::equal;  // structural equality
inline bool graph_equal(const Expr& a, const Expr& b) { return equal(a, b); }
bool expr_uses_var(const Expr& e, const std::string& name);
bool is_pure(const Expr& e);  // has no effects, and no identity beyond its value
Expr simplify(const Expr& e);
bool can_prove(const Expr& condition);  // false means unknown
// Replaces the variable of that name, or the subexpression `find`.
Expr substitute(const std::string& name, const Expr& replacement, const Expr& e);
inline Expr substitute(const char* name, const Expr& replacement, const Expr& e) {
  return substitute(std::string(name), replacement, e);
}
Expr substitute(const std::map<std::string, Expr>& replacements, const Expr& e);
Expr substitute(const Expr& find, const Expr& replacement, const Expr& e);
inline Expr graph_substitute(const std::string& name, const Expr& replacement, const Expr& e) {
  return substitute(name, replacement, e);
}
inline Expr graph_substitute(const char* name, const Expr& replacement, const Expr& e) {
  return substitute(std::string(name), replacement, e);
}
inline Expr graph_substitute(const Expr& find, const Expr& replacement, const Expr& e) {
  return substitute(find, replacement, e);
}
// Binds repeated subexpressions in Lets around the expression; the second function expands Lets.
Expr common_subexpression_elimination(const Expr& e);
Expr substitute_in_all_lets(const Expr& e);

std::string unique_name(char prefix);
std::string unique_name(const std::string& prefix);

}  // namespace retrograde::porting
