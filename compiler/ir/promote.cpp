// Promotion of operand types, and the C++ operators on Expr.
#include "ir/build.h"
#include "ir/literal.h"
#include "ir/overflow.h"
#include "ir/print.h"

namespace retrograde {

namespace ir {

namespace {

void check_operand(const Expr& e, const char* what) {
  if (!e.defined()) {
    user_error(text("apply ", what), "both operands must be defined", "one is an undefined Expr",
               "Give the Expr a value before using it");
  }
  if (e.type().is_handle()) {
    user_error(text("apply ", what), "operands must be numbers",
               text("one has the type ", e.type()), "Use the numbers behind the handle");
  }
}

bool is_type_of_numbers(Type type) {
  const int bits = type.bits();
  if (type.is_float()) return bits == 16 || bits == 32 || bits == 64;
  return type.is_bool() || bits == 8 || bits == 16 || bits == 32 || bits == 64;
}

[[noreturn]] void no_common_type(Type a, Type b, const char* what) {
  user_error(text("apply ", what), "both operands must have a common type",
             text("the types are ", a, " and ", b), "Cast one of them explicitly");
}

Type common_scalar_type(Type a, Type b, const char* what) {
  if (a == b) return a;
  if (a.is_float() != b.is_float()) return a.is_float() ? a : b;
  if (a.is_float() && a.bits() == b.bits()) no_common_type(a, b, what);
  if (a.is_float() || a.code() == b.code()) return a.bits() > b.bits() ? a : b;
  return Int(std::max(a.bits(), b.bits()));
}

}  // namespace

void match_types(Expr& a, Expr& b, const char* what) {
  check_operand(a, what);
  check_operand(b, what);
  if (a.type() == b.type()) return;
  const int lanes = std::max(a.type().lanes(), b.type().lanes());
  for (Expr* e : {&a, &b}) {
    if (e->type().lanes() == lanes) continue;
    if (e->type().is_vector()) no_common_type(a.type(), b.type(), what);
    *e = make_broadcast(*e, lanes);
  }
  const Type type =
      common_scalar_type(a.type().element_of(), b.type().element_of(), what).with_lanes(lanes);
  a = cast_to(type, std::move(a));
  b = cast_to(type, std::move(b));
}

Expr constant_like(const Expr& other, int64_t value, const char* what) {
  check_operand(other, what);
  if (!holds_value(other.type().element_of(), Scalar::of_int(Int(64), value))) {
    user_error(text("apply ", what, " to an expression and the constant ", value),
               "a constant takes the type of the other operand and must fit it",
               text("the other operand has the type ", other.type()),
               "Cast the other operand to a wider type");
  }
  return make_const(other.type(), value);
}

}  // namespace ir

using ir::Kind;

#define RETROGRADE_DEFINE_ARITHMETIC(name, kind)             \
  Expr name(Expr a, Expr b) {                                \
    ir::match_types(a, b, #name);                            \
    return ir::arithmetic(kind, std::move(a), std::move(b)); \
  }
RETROGRADE_DEFINE_ARITHMETIC(operator+, Kind::Add)
RETROGRADE_DEFINE_ARITHMETIC(operator-, Kind::Sub)
RETROGRADE_DEFINE_ARITHMETIC(operator*, Kind::Mul)
#undef RETROGRADE_DEFINE_ARITHMETIC

#define RETROGRADE_DEFINE_OPERATOR(name, kind)           \
  Expr name(Expr a, Expr b) {                            \
    ir::match_types(a, b, #name);                        \
    return ir::binary(kind, std::move(a), std::move(b)); \
  }
RETROGRADE_DEFINE_OPERATOR(operator/, Kind::Div)
RETROGRADE_DEFINE_OPERATOR(operator%, Kind::Mod)
RETROGRADE_DEFINE_OPERATOR(operator<, Kind::LT)
RETROGRADE_DEFINE_OPERATOR(operator<=, Kind::LE)
RETROGRADE_DEFINE_OPERATOR(operator>, Kind::GT)
RETROGRADE_DEFINE_OPERATOR(operator>=, Kind::GE)
RETROGRADE_DEFINE_OPERATOR(min, Kind::Min)
RETROGRADE_DEFINE_OPERATOR(max, Kind::Max)
#undef RETROGRADE_DEFINE_OPERATOR

namespace {

bool are_handles(const Expr& a, const Expr& b) {
  return a.defined() && b.defined() && a.type().is_handle() && a.type() == b.type();
}

// Addresses are compared as numbers.
Expr compared(Kind kind, Expr a, Expr b, const char* what) {
  if (are_handles(a, b)) {
    const Type address = UInt(64, a.type().lanes());
    return ir::binary(kind, ir::reinterpret_as(address, std::move(a)),
                      ir::reinterpret_as(address, std::move(b)));
  }
  ir::match_types(a, b, what);
  return ir::binary(kind, std::move(a), std::move(b));
}

void check_bool(const Expr& e, const char* what) {
  ir::check_operand(e, what);
  if (e.type().is_bool()) return;
  user_error(text("apply ", what), "operands must be bool", text("one has the type ", e.type()),
             "Compare it with something, as in x != 0");
}

Expr logical(Kind kind, Expr a, Expr b, const char* what) {
  check_bool(a, what);
  check_bool(b, what);
  ir::match_types(a, b, what);
  return ir::binary(kind, std::move(a), std::move(b));
}

}  // namespace

Expr operator==(Expr a, Expr b) {
  return compared(Kind::EQ, std::move(a), std::move(b), "operator==");
}
Expr operator!=(Expr a, Expr b) {
  return compared(Kind::NE, std::move(a), std::move(b), "operator!=");
}

Expr operator&&(Expr a, Expr b) {
  return logical(Kind::And, std::move(a), std::move(b), "operator&&");
}
Expr operator||(Expr a, Expr b) {
  return logical(Kind::Or, std::move(a), std::move(b), "operator||");
}

Expr operator!(Expr a) {
  check_bool(a, "operator!");
  return ir::logical_not(std::move(a));
}

// -0.0 - x negates every float, including zeros; 0.0 - 0.0 would be +0.0.
Expr operator-(Expr a) {
  ir::check_operand(a, "operator-");
  const Type type = a.type();
  return ir::binary(Kind::Sub, type.is_float() ? ir::make_const(type, -0.0) : ir::make_zero(type),
                    std::move(a));
}

// The left side keeps its type, as in C++.
#define RETROGRADE_DEFINE_ASSIGNMENT(assign, op) \
  Expr& operator assign(Expr& a, Expr b) {       \
    const Type type = a.type();                  \
    return a = cast(type, a op std::move(b));    \
  }
RETROGRADE_DEFINE_ASSIGNMENT(+=, +)
RETROGRADE_DEFINE_ASSIGNMENT(-=, -)
RETROGRADE_DEFINE_ASSIGNMENT(*=, *)
RETROGRADE_DEFINE_ASSIGNMENT(/=, /)
#undef RETROGRADE_DEFINE_ASSIGNMENT

Expr cast(Type type, Expr value) {
  if (value.defined() && value.type() == type && type.is_handle()) return value;
  ir::check_operand(value, "cast");
  if (type.is_handle() || type.bits() == 0) {
    user_error("cast", "the new type must be a number", text("it is ", type),
               "Use reinterpret for handles");
  }
  if (!ir::is_type_of_numbers(type)) {
    user_error("cast", "integers have 1, 8, 16, 32 or 64 bits, floats 16, 32 or 64",
               text("the new type is ", type), "Name a type of one of these widths");
  }
  if (type.is_vector() && value.type().is_vector() && type.lanes() != value.type().lanes()) {
    ir::no_common_type(type, value.type(), "cast");
  }
  return ir::cast_to(type, std::move(value));
}

namespace {

bool is_int_literal(const Expr& e) {
  return e.type() == Int(32) && ir::as_const_int(e).has_value();
}

// An integer literal takes the type of the value beside it: select(c, f(x), 0).
void match_literals(Expr& a, Expr& b, const char* what) {
  ir::check_operand(a, what);
  ir::check_operand(b, what);
  if (is_int_literal(a) != is_int_literal(b)) {
    Expr& literal = is_int_literal(a) ? a : b;
    const Type other = is_int_literal(a) ? b.type() : a.type();
    const int64_t value = *ir::as_const_int(literal);
    if (other.element_of().can_represent(value)) literal = ir::make_const(other, value);
  }
  ir::match_types(a, b, what);
}

}  // namespace

Expr select(Expr condition, Expr when_true, Expr when_false) {
  check_bool(condition, "select");
  if (!are_handles(when_true, when_false)) match_literals(when_true, when_false, "select");
  return ir::make_select(std::move(condition), std::move(when_true), std::move(when_false));
}

namespace {

// A bound in another integer type would wrap and clamp to a wrong value. Floats only round.
Expr clamp_bound(const Expr& value, Expr bound) {
  const std::string asked = text("clamp ", value, " with the bound ", bound);
  const std::string rule = "a bound is a value of the type that is clamped";
  if (!value.type().is_float() && !ir::is_const(bound) && !ir::always_fits(value.type(), bound)) {
    user_error(asked, rule,
               text(bound.type(), " has values that ", value.type().element_of(), " has not"),
               "Cast the bound, or clamp in the wider type");
  }
  if (bound.type().is_vector() && bound.type().lanes() != value.type().lanes())
    ir::no_common_type(value.type(), bound.type(), "clamp");
  return ir::literal_in(value.type(), std::move(bound), asked, rule);
}

}  // namespace

Expr clamp(Expr value, Expr low, Expr high) {
  for (const Expr* e : {&value, &low, &high}) ir::check_operand(*e, "clamp");
  low = clamp_bound(value, std::move(low));
  high = clamp_bound(value, std::move(high));
  return ir::binary(Kind::Max, ir::binary(Kind::Min, std::move(value), std::move(high)),
                    std::move(low));
}

}  // namespace retrograde
