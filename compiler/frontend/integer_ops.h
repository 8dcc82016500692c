// integer_ops.h -- arithmetic on integers with the width of its result said; and updates at several
// points at once.
#pragma once

#include "frontend/expr_ops.h"

namespace retrograde {

// Division and remainder by an unsigned 8-bit divisor, whose 0 stands for 256; of the type of the
// numerator, an integer of 8, 16 or 32 bits. The remainder is numerator - quotient * divisor, which
// wraps in int8. No faster than the operators here: they find reciprocals of constants by
// themselves.
Expr fast_integer_divide(const Expr& numerator, const Expr& divisor);
Expr fast_integer_modulo(const Expr& numerator, const Expr& divisor);
Expr fast_integer_divide_round_to_zero(const Expr& numerator, const Expr& divisor);

// In twice the bits, where nothing overflows; signed when one operand is.
namespace ir {
inline Type wide_type(const Expr& a, const Expr& b) {
  const bool is_signed = a.type().is_int() || b.type().is_int();
  const int bits = 2 * std::max(a.type().bits(), b.type().bits());
  return a.type().is_float() ? retrograde::Float(bits)
         : is_signed         ? retrograde::Int(bits)
                             : retrograde::UInt(bits);
}
}  // namespace ir
inline Expr widening_mul(const Expr& a, const Expr& b) {
  const Type wide = ir::wide_type(a, b);
  return cast(wide, a) * cast(wide, b);
}
inline Expr widening_add(const Expr& a, const Expr& b) {
  const Type wide = ir::wide_type(a, b);
  return cast(wide, a) + cast(wide, b);
}
// Signed whatever the operands are.
inline Expr widening_sub(const Expr& a, const Expr& b) {
  Type wide = ir::wide_type(a, b);
  if (wide.is_uint()) wide = wide.with_code(TypeCode::Int);
  return cast(wide, a) - cast(wide, b);
}
// Clamped to the range of the operands' type.
inline Expr saturating_add(const Expr& a, const Expr& b) {
  return saturating_cast(a.type(), widening_add(a, b));
}
inline Expr saturating_sub(const Expr& a, const Expr& b) {
  return saturating_cast(a.type(), widening_sub(a, b));
}
// The mean, rounded down or up: no bit is lost on the way. Of the type that a + b has; a C++
// integer takes the other operand's type.
Expr halving_add(Expr a, Expr b);
Expr rounding_halving_add(Expr a, Expr b);
Expr halving_sub(Expr a, Expr b);

// `bits` of e's bits, from the lowest on, as a value of `type`; out of the top come zeros.
inline Expr extract_bits(Type type, const Expr& e, const Expr& lowest) {
  const Type bits = e.type().with_code(TypeCode::UInt);
  return reinterpret(
      type, cast(type.with_code(TypeCode::UInt), reinterpret(bits, e) >> cast(bits, lowest)));
}
template <typename T>
Expr extract_bits(const Expr& e, const Expr& lowest) {
  return extract_bits(type_of<T>(), e, lowest);
}
// The bits of all, the first lowest, as one unsigned number.
Expr concat_bits(const std::vector<Expr>& parts);

// What the caller handed over, for a C function: the JITUserContext of realize(), or one of its
// own; ahead of time, with Target::UserContext, the first argument.
Expr user_context_value();

// f(scatter(a, b)) = gather(u, v): an update that stores to several points, from the first to the
// last; what it reads of f is read before. Between operators they stand for one point after the
// other: f(x + scatter(1, 0), y + scatter(0, 3)) = 2 * gather(x, y). Unsupported where an update
// over an RDom reads the Func that it stores to.
Expr scatter(const std::vector<Expr>& points);
Expr gather(const std::vector<Expr>& points);
template <typename... Points>
requires((std::is_convertible_v<Points, Expr> && ...)) Expr
    scatter(const Expr& first, Points&&... others) {
  return scatter(std::vector<Expr>{first, Expr(std::forward<Points>(others))...});
}
template <typename... Points>
requires((std::is_convertible_v<Points, Expr> && ...)) Expr
    gather(const Expr& first, Points&&... others) {
  return gather(std::vector<Expr>{first, Expr(std::forward<Points>(others))...});
}

}  // namespace retrograde
