// partial.h -- a partial derivative, and its product with an adjoint.
#pragma once

#include <cstdint>
#include <utility>

#include "ir/expr.h"

namespace retrograde::autodiff {

// How a partial is multiplied with the adjoint. A strong zero keeps the product 0 where the other factor is infinite.
enum class Strength : uint8_t {
  Plain,  // the rule promises a finite partial for finite operands; sweeps also check the operands
  Strong,  // the partial may be infinite or NaN where the primal is finite: an adjoint of 0 is a strong zero
  Cut,   // the adjoint may be infinite (it passed a pole): a partial of 0 is a strong zero
  Both,  // Strong and Cut
};
Strength as_strong(Strength strength);
Strength as_cut(Strength strength);

struct Partial {
  Expr factor;  // undefined: no contribution to this operand
  Strength strength = Strength::Strong;
  // The partial is factor / divisor; an undefined divisor means 1. The adjoint is divided before it is multiplied,
  // because 1 / y may overflow where adjoint / y does not.
  Expr divisor = {};
  // The factor is the value of a strong quotient: where it is 0 the partial is 0, whatever the divisor is.
  bool is_strong_quotient = false;
};

// A partial that may be infinite where the adjoint is 0.
inline Partial strong(Expr factor) { return {std::move(factor)}; }

// The type in which the adjoint of a value of floating-point `type` is accumulated: float32 for the 16-bit types.
Type adjoint_type(Type type);

// Whether `e` is a finite constant: 0 times it is 0, so no strong zero is needed.
bool is_finite_constant(const Expr& e);

// Returns adjoint * partial, multiplied as the strength of the partial says. `adjoint` and the result have the adjoint
// type.
Expr times_partial(const Expr& adjoint, const Partial& partial);

}  // namespace retrograde::autodiff
