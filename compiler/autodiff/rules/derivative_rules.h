// derivative_rules.h -- the table of derivatives of scalar operators: partials, domains, conventions and sources.
//
// The rules for structure (select, calls of Funcs, updates) are in reverse_sweep.h and synthesis.h.
#pragma once

#include <vector>

#include "autodiff/rules/partial.h"
#include "ir/expr.h"

namespace retrograde::autodiff {

enum class RuleClass : uint8_t {
  Smooth,    // has partials
  Constant,  // piecewise constant: derivative 0 wherever it exists, and 0 by convention elsewhere
  Transparent,  // returns one argument unchanged, which gets the adjoint of the call
  Blocked,      // 0 because the user requested it: stop_gradient
  NoRule,  // no derivative, for the reason in `convention`; an adjoint that reaches it is an error
};

// Returns the partials for the operands `args`. `value` is the node itself, for rules that reuse it.
using PartialsFn = std::vector<Partial> (*)(const std::vector<Expr>& args, const Expr& value);

struct DerivativeRule {
  RuleClass cls;
  PartialsFn partials;     // Smooth only
  int transparent_arg;     // Transparent only: which argument
  const char* domain;      // where the primal is finite and differentiable
  const char* convention;  // at kinks and poles, or the reason for having no rule
  const char* source;
  // Smooth only: text for docs/derivatives.md and bounds for tests. `formula` gives the partials in terms of the
  // operands x, y, w and the value v; `infinities` gives them at infinite operands. `max_ulp` bounds the error of a
  // partial in float32, in ULP, inside the domain and away from overflow. Tests check it; -1 means as accurate as the
  // approximated function, without a bound.
  const char* formula = "";
  const char* infinities = "";
  int max_ulp = 0;
};

const DerivativeRule& derivative_rule(Op op);
// The rule of a binary kind of kinds.def, or of Not, Cast, Reinterpret or Select.
const DerivativeRule& derivative_rule(Kind kind);
bool has_derivative_rule(Kind kind);

// Whether a partial of the operator may be infinite where its value is finite, as that of sqrt at 0.
bool has_poles(const Call& call);
// Whether the value may be finite, and the partial 0, at an infinite operand, as for exp at -inf.
bool levels_off(Op op);

}  // namespace retrograde::autodiff
