// integer_ops.h -- widening, saturating, rounding and halving arithmetic on integers, bit fields, and updates at
// several points at once.
#pragma once

#include "frontend/language/expr_ops.h"

namespace retrograde {

// Quotient by an unsigned 8-bit divisor, where 0 means 256. The result has the type of the numerator, an
// integer of 8, 16 or 32 bits. No faster than operator/, which replaces constant divisors by multiplications
// itself.
// Requires: every operand must be a defined expression; the numerator is an integer of 8, 16 or 32
// bits; the divisor is of type uint8.
Expr fast_integer_divide(const Expr& numerator, const Expr& divisor);
// Remainder numerator - quotient * divisor of fast_integer_divide; it wraps in int8.
Expr fast_integer_modulo(const Expr& numerator, const Expr& divisor);
// fast_integer_divide with the quotient rounded towards zero.
Expr fast_integer_divide_round_to_zero(const Expr& numerator, const Expr& divisor);

// a * b in twice the bits, which cannot overflow; signed if an operand is.
// Requires: every operand must be a defined expression; its result has at most 64 bits.
Expr widening_mul(const Expr& a, const Expr& b);
// a + b in twice the bits, which cannot overflow; signed if an operand is.
Expr widening_add(const Expr& a, const Expr& b);
// a - b in twice the bits, which cannot overflow; always signed.
Expr widening_sub(const Expr& a, const Expr& b);
// a + b, clamped to the range of the type of `a`.
// Requires: every operand must be a defined expression; it takes integers; its result has at most
// 64 bits.
Expr saturating_add(const Expr& a, const Expr& b);
// a - b, clamped to the range of the type of `a`.
Expr saturating_sub(const Expr& a, const Expr& b);
// `a` shifted left in twice its bits; a negative amount shifts right.
// Requires: every operand must be a defined expression; it takes integers; its result has at most
// 64 bits.
Expr widening_shift_left(const Expr& a, const Expr& b);
// `a` shifted right in twice its bits; a negative amount shifts left.
Expr widening_shift_right(const Expr& a, const Expr& b);
// a << b, clamped to the range of the type of `a`. A negative amount shifts right and rounds to nearest,
// halves up.
Expr rounding_shift_left(const Expr& a, const Expr& b);
// a >> b, rounded to nearest, halves up, and clamped to the range of the type of `a`.
Expr rounding_shift_right(const Expr& a, const Expr& b);
// (a * b) >> q, computed in twice the bits and clamped to the range of the type that a * b has.
Expr mul_shift_right(const Expr& a, const Expr& b, const Expr& q);
// mul_shift_right, rounded to nearest, halves up.
Expr rounding_mul_shift_right(const Expr& a, const Expr& b, const Expr& q);
// a + b in the type of `a`, where `b` has half its bits; the result wraps.
// Requires: the second operand has half the bits of the first.
Expr widen_right_add(const Expr& a, const Expr& b);
// a * b in the type of `a`, where `b` has half its bits; the result wraps.
Expr widen_right_mul(const Expr& a, const Expr& b);
// a - b in the type of `a`, where `b` has half its bits; the result wraps.
Expr widen_right_sub(const Expr& a, const Expr& b);
// (a + b) / 2, rounded down, without intermediate overflow. The result has the type of a + b; a C++ integer
// takes the other operand's type.
// Requires: it takes integers; a constant takes the type of the other operand and must fit it.
Expr halving_add(Expr a, Expr b);
// (a + b) / 2, rounded up, without intermediate overflow.
Expr rounding_halving_add(Expr a, Expr b);
// (a - b) / 2, rounded down, without intermediate overflow.
Expr halving_sub(Expr a, Expr b);

// The bits of `e` from position `lowest` upwards, as a value of `type`; bits beyond the top are zero.
// Requires: every operand must be a defined expression; it takes integers.
Expr extract_bits(Type type, const Expr& e, const Expr& lowest);
template <typename T>
Expr extract_bits(const Expr& e, const Expr& lowest) {
  return extract_bits(type_of<T>(), e, lowest);
}
// One unsigned number from the bits of all parts; the first part holds the lowest bits.
// Requires: there is at least one part; every part is a defined expression; all parts have one
// type; the result has 8, 16, 32 or 64 bits.
Expr concat_bits(const std::vector<Expr>& parts);

// The user context of the call, to pass to a C function: the JITUserContext of realize(), or the default one.
// Ahead of time, with Target::UserContext, it is the function's first argument.
Expr user_context_value();

// The points that an update stores to, in order: f(scatter(a, b)) = gather(u, v) stores f(u) to f(a) and f(v)
// to f(b). All reads of f come before the stores. Over an RDom this holds for each iteration, which sees the
// stores of earlier ones: f(scatter(r, r + 1)) = f(gather(r + 1, r)) moves f(0) to the end. Operators apply
// point by point: f(x + scatter(1, 0), y + scatter(0, 3)) = 2 * gather(x, y).
// Requires: at least one point is named; each point is a defined Expr; all points are of one type; a first
// definition is for all points; scatter() names the places on the left-hand side; all scatter() and gather()
// of an update have the same number of points.
Expr scatter(const std::vector<Expr>& points);
// The values or coordinates that an update reads, one for each point of scatter().
Expr gather(const std::vector<Expr>& points);
template <std::convertible_to<Expr>... Points>
Expr scatter(const Expr& first, Points&&... others) {
  return scatter(std::vector<Expr>{first, Expr(std::forward<Points>(others))...});
}
template <std::convertible_to<Expr>... Points>
Expr gather(const Expr& first, Points&&... others) {
  return gather(std::vector<Expr>{first, Expr(std::forward<Points>(others))...});
}

}  // namespace retrograde
