// integer_ops.h -- arithmetic on integers with the width of its result said; and updates at several
// points at once.
#pragma once

#include "frontend/language/expr_ops.h"

namespace retrograde {

// Division and remainder by an unsigned 8-bit divisor, whose 0 stands for 256; of the type of the
// numerator, an integer of 8, 16 or 32 bits. The remainder is numerator - quotient * divisor, which
// wraps in int8. No faster than the operators here: they find reciprocals of constants by
// themselves.
// Requires: every operand must be a defined expression; the numerator is an integer of 8, 16 or 32
// bits; the divisor is of type uint8.
Expr fast_integer_divide(const Expr& numerator, const Expr& divisor);
Expr fast_integer_modulo(const Expr& numerator, const Expr& divisor);
Expr fast_integer_divide_round_to_zero(const Expr& numerator, const Expr& divisor);

// In twice the bits, where nothing overflows; signed when one operand is.
// Requires: every operand must be a defined expression; its result has at most 64 bits.
Expr widening_mul(const Expr& a, const Expr& b);
Expr widening_add(const Expr& a, const Expr& b);
// Signed whatever the operands are.
Expr widening_sub(const Expr& a, const Expr& b);
// Clamped to the range of the type of `a`; computed in twice the bits.
// Requires: every operand must be a defined expression; it takes integers; its result has at most
// 64 bits.
Expr saturating_add(const Expr& a, const Expr& b);
Expr saturating_sub(const Expr& a, const Expr& b);
// `a` shifted in twice its bits; a negative amount shifts the other way.
// Requires: every operand must be a defined expression; it takes integers; its result has at most
// 64 bits.
Expr widening_shift_left(const Expr& a, const Expr& b);
Expr widening_shift_right(const Expr& a, const Expr& b);
// As << and >>, computed in twice the bits; what is shifted out to the right rounds to the nearest,
// halves up, and the result is clamped to the range of the type of `a`.
Expr rounding_shift_left(const Expr& a, const Expr& b);
Expr rounding_shift_right(const Expr& a, const Expr& b);
// The product in twice the bits, shifted right by `q` and clamped to the range of the type that
// a * b has; the second rounds to the nearest, halves up.
Expr mul_shift_right(const Expr& a, const Expr& b, const Expr& q);
Expr rounding_mul_shift_right(const Expr& a, const Expr& b, const Expr& q);
// Combines `a` with a `b` of half its bits, in the type of `a`; the result wraps.
// Requires: the second operand has half the bits of the first.
Expr widen_right_add(const Expr& a, const Expr& b);
Expr widen_right_mul(const Expr& a, const Expr& b);
Expr widen_right_sub(const Expr& a, const Expr& b);
// The mean, rounded down or up: no bit is lost on the way. Of the type that a + b has; a C++
// integer takes the other operand's type.
// Requires: it takes integers; a constant takes the type of the other operand and must fit it.
Expr halving_add(Expr a, Expr b);
Expr rounding_halving_add(Expr a, Expr b);
Expr halving_sub(Expr a, Expr b);

// `bits` of e's bits, from the lowest on, as a value of `type`; out of the top come zeros.
// Requires: every operand must be a defined expression; it takes integers.
Expr extract_bits(Type type, const Expr& e, const Expr& lowest);
template <typename T>
Expr extract_bits(const Expr& e, const Expr& lowest) {
  return extract_bits(type_of<T>(), e, lowest);
}
// The bits of all, the first lowest, as one unsigned number.
// Requires: there is at least one part; every part is a defined expression; all parts have one
// type; the result has 8, 16, 32 or 64 bits.
Expr concat_bits(const std::vector<Expr>& parts);

// What the caller handed over, for a C function: the JITUserContext of realize(), or one of its
// own; ahead of time, with Target::UserContext, the first argument.
Expr user_context_value();

// f(scatter(a, b)) = gather(u, v): an update that stores to several points, from the first to the
// last; what it reads of f is read before. Over an RDom each iteration does so, and finds what those
// before it stored: f(scatter(r, r + 1)) = f(gather(r + 1, r)) moves f(0) to the end. Between
// operators they stand for one point after the other: f(x + scatter(1, 0), y + scatter(0, 3)) =
// 2 * gather(x, y).
// Requires: at least one point is named; each point is a defined Expr; all points are of one type;
// a first definition is for all points; scatter() names the places on the left-hand side; all of an
// update's scatter() and gather() have as many points.
Expr scatter(const std::vector<Expr>& points);
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
