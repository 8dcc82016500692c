// integer_ops.h -- arithmetic on integers with the width of its result said; and accesses of many
// points at once, which are not there.
#pragma once

#include "frontend/expr_ops.h"

namespace retrograde {

// Division and remainder by an unsigned 8-bit divisor, of the numerator's type. No faster than the
// operators here: they find reciprocals of constants by themselves.
inline Expr fast_integer_divide(const Expr& numerator, const Expr& divisor) {
  return numerator / cast(numerator.type(), divisor);
}
inline Expr fast_integer_modulo(const Expr& numerator, const Expr& divisor) {
  return numerator % cast(numerator.type(), divisor);
}
inline Expr fast_integer_divide_round_to_zero(const Expr& numerator, const Expr& divisor) {
  return div_round_to_zero(numerator, cast(numerator.type(), divisor));
}

// In twice the bits, where nothing overflows.
inline Expr widening_mul(const Expr& a, const Expr& b) {
  const bool is_signed = a.type().is_int() || b.type().is_int();
  const int bits = 2 * std::max(a.type().bits(), b.type().bits());
  const Type wide = a.type().is_float() ? Float(bits) : is_signed ? Int(bits) : UInt(bits);
  return cast(wide, a) * cast(wide, b);
}

// f(scatter(a, b)) = gather(x, y): several points in one definition.
template <typename... Points>
Expr gather(const Expr&, Points&&...) {
  unsupported("define several points with gather()", "a definition stores to one point at a time",
              "gather() reads many", "Write one update definition for each point");
}
template <typename... Points>
Expr scatter(const Expr&, Points&&...) {
  unsupported("define several points with scatter()", "a definition stores to one point at a time",
              "scatter() names many", "Write one update definition for each point");
}

}  // namespace retrograde
