// Index expressions as linear sums (ir/sum.h), and the uses of that form: canonical text, constant
// differences, and linear conditions solved for a variable. Only scalars of Int(32) and Int(64),
// which are assumed not to overflow; everything else is an atom.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "analysis/interval.h"
#include "analysis/scope.h"
#include "ir/expr.h"
#include "ir/sum.h"

namespace retrograde::analysis {

// Whether the type is a scalar Int(32) or Int(64).
bool has_linear_form(Type type);
Sum linear_form(const Expr& e);

// A sum that is at least 0 exactly where the comparison holds; nullopt for anything but <, <=, >
// and >= of sums.
std::optional<Sum> nonnegative_where(const Expr& comparison);

// a - b, if it is the same for all values of all variables.
std::optional<int64_t> constant_difference(const Expr& a, const Expr& b);
// The expression in canonical form, with like terms gathered; the same handle when it is not a sum.
Expr canonical(const Expr& e);

// min and max in canonical form. Operands that a constant difference rules out are dropped; the
// others keep their order.
Expr canonical_min(const Expr& a, const Expr& b);
Expr canonical_max(const Expr& a, const Expr& b);
// floor(e / divisor) for divisor > 0, with multiples of the divisor moved out of the division.
Expr canonical_div(const Expr& e, int64_t divisor);

// e = sum of coefficient * variable over `variables`, plus `rest`, which is free of them. nullopt
// when e is not linear in them.
struct LinearDecomposition {
  std::vector<std::pair<std::string, int64_t>> coefficients;  // in the order of `variables`
  Expr rest;
};
std::optional<LinearDecomposition> decompose(const Expr& e,
                                             const std::vector<std::string>& variables);

// A set on which a condition holds: for every value of `variable` in `interval`, provided that
// `needed` (free of the variable; undefined: true) holds, and for all values of the inner variables
// in their intervals.
struct Solution {
  Interval interval;
  Expr needed;
};
// Solves a condition: conjunctions, disjunctions and negations of integer comparisons, linear in
// `variable`, also through division by a positive constant, min and max. Names in `inner` are
// universally quantified over their intervals, whose ends may mention `variable` but no other inner
// name. nullopt when no such set was found.
std::optional<Solution> solve_for(const Expr& condition, const std::string& variable,
                                  const Scope<Interval>& inner);

}  // namespace retrograde::analysis
