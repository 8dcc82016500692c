#include "ir/fold.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "ir/build.h"
#include "ir/constants.h"
#include "ir/scalar.h"
#include "ir/visit.h"

namespace retrograde::ir {

namespace {

bool is_negative_zero(const Expr& e) {
  const std::optional<double> value = as_const_float(e);
  return value && *value == 0 && std::signbit(*value);
}

// x + -0.0, x - 0.0, x * 1.0 and x / 1.0 equal x for every x, including NaN, infinities and -0.0.
// x + 0.0 does not.
Expr fold_float(Kind kind, const Expr& a, const Expr& b) {
  switch (kind) {
    case Kind::Add:
      return is_negative_zero(b) ? a : is_negative_zero(a) ? b : Expr();
    case Kind::Sub:
      return is_zero(b) && !is_negative_zero(b) ? a : Expr();
    case Kind::Mul:
      return is_one(b) ? a : is_one(a) ? b : Expr();
    case Kind::Div:
      return is_one(b) ? a : Expr();
    case Kind::Min:
    case Kind::Max:
      return a.same_as(b) ? a : Expr();
    default:
      return {};
  }
}

Expr fold_integer_compare(Kind kind, const Expr& a, const Expr& b) {
  if (!a.same_as(b)) return {};
  const bool result = kind == Kind::EQ || kind == Kind::LE || kind == Kind::GE;
  return make_const(Bool(a.type().lanes()), int64_t{result});
}

Expr fold_integer(Kind kind, const Expr& a, const Expr& b) {
  switch (kind) {
    case Kind::Add:
      return is_zero(b) ? a : is_zero(a) ? b : Expr();
    case Kind::Sub:
      return is_zero(b) ? a : a.same_as(b) ? make_zero(a.type()) : Expr();
    case Kind::Mul:
      return is_one(b) || is_zero(a) ? a : is_one(a) || is_zero(b) ? b : Expr();
    case Kind::Div:  // 0 / x and x / 0 are 0
      return is_one(b) || is_zero(a) ? a : is_zero(b) ? b : Expr();
    case Kind::Mod:
      return is_one(b) || is_zero(b) || is_zero(a) ? make_zero(a.type()) : Expr();
    case Kind::Min:
    case Kind::Max:
      return a.same_as(b) ? a : Expr();
    default:
      return fold_integer_compare(kind, a, b);
  }
}

Expr fold_logical(Kind kind, const Expr& a, const Expr& b) {
  const bool absorbing = kind == Kind::Or;  // true || x, false && x
  for (const auto& [x, y] : {std::pair(a, b), std::pair(b, a)}) {
    if (is_const_true(x)) return absorbing ? x : y;
    if (is_const_false(x)) return absorbing ? y : x;
  }
  return a.same_as(b) ? a : Expr();
}

// Evaluates an expression over constants that calls functions which only code generation folds.
// Used for integers and conditions that depend on them, such as loop extents. `budget` limits the
// size, because shared nodes are visited again.
std::optional<Scalar> value_over_constants(const Expr& e, int& budget) {
  if (--budget < 0) return std::nullopt;
  if (auto known = as_scalar(e)) return known;
  std::vector<Scalar> args;
  bool is_known = true;
  for_each_child(e, [&](const Expr& child) {
    const auto value = is_known ? value_over_constants(child, budget) : std::nullopt;
    is_known = value.has_value();
    if (value) args.push_back(*value);
  });
  if (!is_known || args.empty() || !e.type().is_float()) return std::nullopt;
  const Type type = e.type().element_of();
  if (const auto* call = e.as<Call>())
    return call->call_type == CallType::Operator ? eval_operator(call->op, args, type)
                                                 : std::nullopt;
  if (e.kind() == Kind::Cast) return eval_cast(type, args[0]);
  if (e.kind() == Kind::Broadcast) return args[0];
  const bool is_arithmetic = e.kind() >= Kind::Add && e.kind() <= Kind::Max;
  return is_arithmetic ? std::optional(eval_binary(e.kind(), args[0], args[1])) : std::nullopt;
}
std::optional<Scalar> value_over_constants(const Expr& e) {
  int budget = 100;
  return value_over_constants(e, budget);
}

// A float outside an integer type's range converts as the machine does, so it is not folded.
bool cast_is_defined(Type to, const Scalar& from) {
  if (!from.type.is_float() || to.is_float() || to.is_bool()) return true;
  return std::isfinite(from.f) && to.can_represent(std::trunc(from.f));
}

// Generated code implements these functions itself, and may differ in the last bit: they are folded
// where it is generated.
bool is_rounded_otherwise(Op op) { return op_info(op).real.error.kind == OpError::Kind::Library; }

bool is_zero_or_one(const Scalar& s) { return s.f == 0 || s.f == 1; }

}  // namespace

Expr fold_binary(Kind kind, Type result, const Expr& a, const Expr& b) {
  const std::optional<Scalar> x = as_scalar(a);
  const std::optional<Scalar> y = x ? as_scalar(b) : std::nullopt;
  if (x && y) return constant(eval_binary(kind, *x, *y), result.lanes());
  if (result.is_bool() && a.type().is_float()) {  // a comparison
    const auto u = value_over_constants(a), v = u ? value_over_constants(b) : u;
    if (u && v) return constant(eval_binary(kind, *u, *v), result.lanes());
  }
  if (kind == Kind::And || kind == Kind::Or) return fold_logical(kind, a, b);
  if (a.type().is_float()) return fold_float(kind, a, b);
  return a.type().is_int_or_uint() ? fold_integer(kind, a, b) : Expr();
}

Expr fold_cast(Type type, const Expr& value) {
  const bool may_round = value.type().is_float() && !type.is_float();
  const std::optional<Scalar> s = may_round ? value_over_constants(value) : as_scalar(value);
  if (!s || !cast_is_defined(type.element_of(), *s)) return {};
  return constant(eval_cast(type.element_of(), *s), type.lanes());
}

Expr fold_reinterpret(Type type, const Expr& value) {
  const std::optional<Scalar> s = as_scalar(value);
  if (!s || type.lanes() != value.type().lanes() || type.is_handle()) return {};
  const Scalar result = eval_reinterpret(type.element_of(), *s);
  if (type.is_float() && std::isnan(result.f)) return {};  // NaNs carry payloads
  return constant(result, type.lanes());
}

Expr fold_operator(Op op, Type type, const std::vector<Expr>& args) {
  std::vector<Scalar> values;
  for (const Expr& arg : args) {
    const std::optional<Scalar> value = as_scalar(arg);
    if (!value) return {};
    values.push_back(*value);
  }
  const Scalar result = *eval_operator(op, values, type.element_of());
  // Exact cases: cos(0), log(1) and the like.
  const bool is_exact = !is_rounded_otherwise(op) ||
                        (is_zero_or_one(result) && std::ranges::all_of(values, is_zero_or_one));
  return is_exact ? constant(result, type.lanes()) : Expr();
}

}  // namespace retrograde::ir
