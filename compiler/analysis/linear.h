// Index expressions as linear sums (ir/sum.h), and what follows from that form: canonical text,
// differences that are constant, and linear conditions solved for a variable. Scalars of Int(32) and
// Int(64) only (they are assumed not to overflow); everything else is an atom.
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

// The type is Int of 32 or 64 bits, scalar.
bool has_linear_form(Type type);
Sum linear_form(const Expr& e);

// The sum that is at least 0 where the comparison holds, and nowhere else; nullopt for anything that
// is no <, <=, >, >= of sums.
std::optional<Sum> nonnegative_where(const Expr& comparison);

// a - b when it is the same for all values of all variables.
std::optional<int64_t> constant_difference(const Expr& a, const Expr& b);
// The expression in canonical form: like terms gathered; the same handle when it is no sum.
Expr canonical(const Expr& e);

// min and max in canonical form. Operands that a constant difference decides are dropped; the rest
// keep their order.
Expr canonical_min(const Expr& a, const Expr& b);
Expr canonical_max(const Expr& a, const Expr& b);
// floor(e / divisor), divisor > 0, with multiples of the divisor taken out of the division.
Expr canonical_div(const Expr& e, int64_t divisor);

// e = sum of coefficient * variable over the given variables, plus `rest`, in which none of them
// occurs. nullopt when e is not linear in them.
struct LinearDecomposition {
  std::vector<std::pair<std::string, int64_t>> coefficients;  // as the variables were given
  Expr rest;
};
std::optional<LinearDecomposition> decompose(const Expr& e,
                                             const std::vector<std::string>& variables);

// Where a condition certainly holds: for every value of `variable` in `interval`, provided that
// `needed` (free of the variable; undefined: true) holds, and for all values of the inner variables
// in their intervals.
struct Solution {
  Interval interval;
  Expr needed;
};
// The condition: conjunctions, disjunctions and negations of comparisons of integers, linear in
// `variable`, also through division by a positive constant, min and max. Names in `inner` are
// quantified over their intervals, whose ends may mention `variable` but no other inner name.
// nullopt: no such set was found.
std::optional<Solution> solve_for(const Expr& condition, const std::string& variable,
                                  const Scope<Interval>& inner);

}  // namespace retrograde::analysis
