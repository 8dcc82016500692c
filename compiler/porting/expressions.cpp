#include "porting/expressions.h"

#include <bit>
#include <functional>

#include "ir/scalar.h"
#include "ir/visit.h"
#include "simplify/cse.h"
#include "simplify/simplify.h"

namespace retrograde::porting {

namespace {

std::optional<ir::Scalar> scalar_of(const Expr& e) {
  return e.defined() ? ir::as_scalar(e) : std::nullopt;
}

}  // namespace

bool is_positive_const(const Expr& e) {
  const auto value = scalar_of(e);
  return value && value->as_double() > 0;
}
bool is_negative_const(const Expr& e) {
  const auto value = scalar_of(e);
  return value && value->as_double() < 0;
}

std::optional<int> is_const_power_of_two_integer(const Expr& e) {
  const auto value = scalar_of(e);
  if (!value || !value->type.is_int_or_uint()) return std::nullopt;
  if (value->type.is_int() && value->i <= 0) return std::nullopt;
  const uint64_t bits = value->type.is_int() ? static_cast<uint64_t>(value->i) : value->u;
  return std::has_single_bit(bits) ? std::optional(std::countr_zero(bits)) : std::nullopt;
}

std::optional<uint64_t> as_const_uint(const Expr& e) {
  const auto value = scalar_of(e);
  return value && value->type.is_uint() ? std::optional(value->u) : std::nullopt;
}

bool expr_uses_var(const Expr& e, const std::string& name) { return ir::uses_variable(e, name); }

bool is_pure(const Expr& e) {
  return !ir::any_node(e, [](const ir::Call& call) { return !call.is_pure(); });
}

Expr simplify(const Expr& e) { return e.defined() ? simplification::simplify(e) : e; }
bool can_prove(const Expr& condition) { return simplification::can_prove(condition); }

Expr substitute(const std::string& name, const Expr& replacement, const Expr& e) {
  return ir::substitute(e, name, replacement);
}
Expr substitute(const std::map<std::string, Expr>& replacements, const Expr& e) {
  return ir::substitute(e, replacements);
}
Expr substitute(const Expr& find, const Expr& replacement, const Expr& e) {
  return ir::rewrite(e, [&](const Expr& node, const std::function<Expr(const Expr&)>&) {
    return equal(node, find) ? replacement : Expr();
  });
}

Expr common_subexpression_elimination(const Expr& e) {
  return e.defined() ? simplification::introduce_lets(e) : e;
}
Expr substitute_in_all_lets(const Expr& e) {
  return e.defined() ? simplification::expand_lets(e) : e;
}

std::string unique_name(char prefix) { return ir::unique_name(std::string(1, prefix)); }
std::string unique_name(const std::string& prefix) { return ir::unique_name(prefix); }

}  // namespace retrograde::porting
