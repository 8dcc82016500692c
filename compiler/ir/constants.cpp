// Constants: immediates of every type, and the questions whether an expression is one.
#include "ir/constants.h"

#include <cmath>
#include <limits>

#include "ir/build.h"

namespace retrograde {

Expr Type::max() const {
  if (is_float()) return ir::make_const(*this, std::numeric_limits<double>::infinity());
  if (is_int()) return ir::make_const(*this, max_int());
  if (is_uint()) return ir::make_uint_const(*this, max_uint());
  user_error("take the largest value of a handle", "only numbers have one",
             "a handle is an address", "Ask a type of numbers");
}

Expr Type::min() const {
  if (is_float()) return ir::make_const(*this, -std::numeric_limits<double>::infinity());
  if (is_int()) return ir::make_const(*this, min_int());
  if (is_uint()) return ir::make_uint_const(*this, 0);
  user_error("take the smallest value of a handle", "only numbers have one",
             "a handle is an address", "Ask a type of numbers");
}

}  // namespace retrograde

namespace retrograde::ir {

namespace {

// Every NaN becomes the one quiet NaN that the printer can print.
Expr float_const(Type scalar, double value) {
  if (std::isnan(value)) value = std::numeric_limits<double>::quiet_NaN();
  return make_node<FloatImm>(scalar, round_to_type(scalar, value));
}

Expr scalar_const(const Scalar& s) {
  if (s.type.is_float()) return float_const(s.type, s.f);
  if (s.type.is_int()) return make_node<IntImm>(s.type, s.i);
  if (s.type.is_uint()) return make_node<UIntImm>(s.type, s.u);
  return make_node<Reinterpret>(s.type, make_node<UIntImm>(UInt(64), s.u));
}

}  // namespace

Expr splat(Expr value, int lanes) {
  if (lanes == 1) return value;
  const Type type = value.type().with_lanes(value.type().lanes() * lanes);
  return make_node<Broadcast>(type, std::move(value), lanes);
}

Expr constant(const Scalar& s, int lanes) { return splat(scalar_const(s), lanes); }

Expr make_const(Type type, int64_t value) {
  if (type.is_float())
    return constant(eval_cast(type.element_of(), Scalar::of_int(Int(64), value)), type.lanes());
  return constant(Scalar::of_int(type, value), type.lanes());
}

Expr make_const(Type type, double value) {
  if (type.is_float()) return splat(float_const(type.element_of(), value), type.lanes());
  return constant(eval_cast(type.element_of(), Scalar::of_float(Float(64), value)), type.lanes());
}

Expr make_uint_const(Type type, uint64_t value) {
  if (type.is_float())
    return constant(eval_cast(type.element_of(), Scalar::of_uint(UInt(64), value)), type.lanes());
  return constant(Scalar::of_uint(type, value), type.lanes());
}

Expr make_zero(Type type) { return make_const(type, int64_t{0}); }
Expr make_one(Type type) { return make_const(type, int64_t{1}); }
Expr const_true(int lanes) { return make_one(Bool(lanes)); }
Expr const_false(int lanes) { return make_zero(Bool(lanes)); }

std::optional<int64_t> as_const_int(const Expr& e) {
  const std::optional<Scalar> s = as_scalar(e);
  if (!s || !s->type.is_int_or_uint()) return std::nullopt;
  if (s->type.is_uint() && s->u > static_cast<uint64_t>(INT64_MAX)) return std::nullopt;
  return s->i;
}

std::optional<double> as_const_float(const Expr& e) {
  const std::optional<Scalar> s = as_scalar(e);
  if (!s || !s->type.is_float()) return std::nullopt;
  return s->f;
}

namespace {
bool is_number(const Expr& e, int value) {
  const std::optional<Scalar> s = as_scalar(e);
  return s && (s->type.is_float() ? s->f == value
               : s->type.is_int() ? s->i == value
                                  : s->u == uint64_t(value));
}
}  // namespace

bool is_const(const Expr& e) { return as_scalar(e).has_value(); }
bool is_zero(const Expr& e) { return is_number(e, 0); }
bool is_one(const Expr& e) { return is_number(e, 1); }
bool is_const_true(const Expr& e) { return e.defined() && e.type().is_bool() && is_one(e); }
bool is_const_false(const Expr& e) { return e.defined() && e.type().is_bool() && is_zero(e); }
bool is_const_int(const Expr& e, int64_t value) { return as_const_int(e) == value; }

}  // namespace retrograde::ir
