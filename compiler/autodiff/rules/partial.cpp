#include "autodiff/rules/partial.h"

#include <cmath>

#include "ir/build.h"

namespace retrograde::autodiff {

Type adjoint_type(Type type) {
  const bool is_kept = type.is_float() && type.bits() >= 32;
  return is_kept ? type : Float(32, type.lanes());
}

bool is_finite_constant(const Expr& e) {
  auto value = as_const_float(e);
  return value && std::isfinite(*value);
}

namespace {

bool is_cut(Strength strength) { return strength == Strength::Cut || strength == Strength::Both; }
bool is_strong(Strength strength) {
  return strength == Strength::Strong || strength == Strength::Both;
}

// Computes adjoint / divisor * factor in that order. A constant factor, whose magnitude is at most 1, is applied first:
// it cannot overflow, and one division is enough.
Expr divided_first(const Expr& adjoint, const Partial& partial) {
  const Expr divisor = cast_to(adjoint.type(), partial.divisor);
  const bool is_scaled = is_const(partial.factor);
  const Expr scaled =
      is_scaled ? times_partial(adjoint, {partial.factor, Strength::Plain}) : adjoint;
  const Expr divided = partial.strength == Strength::Strong
                           ? call_op(Op::strong_div, adjoint.type(), {scaled, divisor})
                           : scaled / divisor;
  // The quotient may have overflowed where the factor is 0.
  return is_scaled ? divided : times_partial(divided, {partial.factor, Strength::Both});
}

}  // namespace

Strength as_strong(Strength strength) {
  return is_cut(strength) ? Strength::Both : Strength::Strong;
}
Strength as_cut(Strength strength) { return is_strong(strength) ? Strength::Both : Strength::Cut; }

Expr times_partial(const Expr& adjoint, const Partial& partial) {
  if (is_zero(partial.factor)) return make_zero(adjoint.type());
  // A select stays a select: inf * 0 would put a NaN into the adjoint of the operand that was not chosen.
  if (const auto* choice = partial.factor.as<Select>()) {
    return make_select(
        choice->condition,
        times_partial(adjoint, {choice->when_true, partial.strength, partial.divisor}),
        times_partial(adjoint, {choice->when_false, partial.strength, partial.divisor}));
  }
  if (partial.divisor.defined()) {
    if (!is_cut(partial.strength)) return divided_first(adjoint, partial);
    const Expr factor = partial.is_strong_quotient ? call_op(Op::strong_div, partial.factor.type(),
                                                             {partial.factor, partial.divisor})
                                                   : partial.factor / partial.divisor;
    return times_partial(adjoint, {factor, partial.strength});
  }
  Expr factor = cast_to(adjoint.type(), partial.factor);
  if (is_one(factor)) return adjoint;
  if (is_finite_constant(factor) || partial.strength == Strength::Plain) return adjoint * factor;
  if (partial.strength == Strength::Cut)
    return call_op(Op::strong_mul, adjoint.type(), {factor, adjoint});
  Expr product = call_op(Op::strong_mul, adjoint.type(), {adjoint, factor});
  if (partial.strength != Strength::Both) return product;
  // Both branches are products, so that differentiating this expression again gives the derivative of a product where
  // the factor is 0.
  return make_select(factor == make_zero(factor.type()),
                     call_op(Op::strong_mul, product.type(), {factor, adjoint}), product);
}

}  // namespace retrograde::autodiff
