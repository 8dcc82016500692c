// The scalar derivative rules: one table over all operators and binary kinds, with domains,
// conventions and sources. Structural rules (select, calls of Funcs, updates) stand in
// reverse_sweep.h and synthesis.h.
#pragma once

#include <vector>

#include "ir/expr.h"

namespace retrograde::autodiff {

enum class RuleClass : uint8_t {
  Smooth,    // has partials
  Constant,  // piecewise constant: derivative 0 wherever it exists, and 0 by convention elsewhere
  Transparent,  // the value of one argument: its adjoint is the call's
  Blocked,      // 0 because the user says so
  NoRule,       // no derivative; `convention` says why. Reaching one with an adjoint is an error.
};

// How a partial meets the adjoint: strongly, unless nothing infinite can meet a zero.
enum class Strength : uint8_t {
  Plain,   // finite wherever the operands are, says the rule; the sweeps look at the operands, too
  Strong,  // may be infinite or NaN where the primal is finite: an adjoint of 0 makes the product 0
  Cut,     // the adjoint may be infinite (it passed a pole): a partial of 0 makes the product 0
  Both,    // Strong and Cut
};
Strength made_strong(Strength strength);
Strength made_cut(Strength strength);

struct Partial {
  Expr factor;  // undefined: this operand gets nothing
  Strength strength = Strength::Strong;
  // The partial is factor / divisor; undefined: 1. The adjoint is divided before it is multiplied:
  // 1 / y may overflow where adjoint / y, an adjoint itself, does not.
  Expr divisor = {};
  // A factor of 0 stays 0 whatever the divisor is: it is the value of a strong quotient.
  bool is_strong_quotient = false;
};

// A partial that may be infinite where an adjoint is 0.
inline Partial strong(Expr factor) { return {std::move(factor)}; }

// Partials for operands `args` with value `value` (the node itself, for rules that reuse it).
using PartialsFn = std::vector<Partial> (*)(const std::vector<Expr>& args, const Expr& value);

struct DerivativeRule {
  RuleClass cls;
  PartialsFn partials;     // Smooth only
  int transparent_arg;     // Transparent only: which argument
  const char* domain;      // where the primal is finite and differentiable
  const char* convention;  // at kinks and poles, or the reason for having no rule
  const char* source;
  // Smooth only, for people: partials over the operands x, y, w and the value v; what they are at
  // infinite operands; how far a partial in float32 is from the true one, in ULP, inside the domain
  // and away from overflow (rule tables are tested against it; -1: as the approximation, not
  // bounded).
  const char* formula = "";
  const char* infinities = "";
  int max_ulp = 0;
};

const DerivativeRule& derivative_rule(Op op);
// Binary kinds of kinds.def and Not, Cast, Reinterpret, Select.
const DerivativeRule& derivative_rule(Kind kind);
bool has_derivative_rule(Kind kind);  // whether the table has a row for the kind

// A number that keeps a zero that it multiplies.
bool is_finite_constant(const Expr& e);

// The type in which the adjoint of a value of floating `type` is accumulated: float32 for the
// 16-bit floats.
Type adjoint_type(Type type);
// Whether a partial of the operator may be infinite where its value is finite: sqrt at 0.
bool has_poles(const Call& call);
// Whether the value may be finite, and the partial 0, where an operand is infinite: exp at -inf.
bool levels_off(Op op);
// adjoint * partial, by the partial's strength; `adjoint` and the result are of the adjoint type.
Expr times_partial(const Expr& adjoint, const Partial& partial);

}  // namespace retrograde::autodiff
