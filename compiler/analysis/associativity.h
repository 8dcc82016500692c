// associativity.h -- proofs that an update combines elements by an associative operator.
//
// An update replaces the values x of an element by F(x, g), g being what does not depend on x. Here
// an operator op on elements and a constant id are found with F(x, g) == op(x, F(id, g)), op
// associative and id its identity: so partial results, each started from id, may be combined.
//
//   F(x, g) = x + g                                        op(x, y) = x + y         id = 0
//   F(x, g) = {min(x0, g0), select(g0 < x0, g1, x1)}       the same with y for g    {inf, any}
//   F(x, g) = {x0 * g0 - x1 * g1, x0 * g1 + x1 * g0}       the same with y for g    {1, 0}
//
// Method: candidates from a table of operators, and from F itself with parts of y in the place of
// g. A candidate counts only when its laws are proven: comparisons are decided by cases over every
// order of the values that are compared, and under each of them both sides are polynomials with
// integer coefficients (or bits, for bitwise operators), which are equal when their normal forms
// are. Integers form a ring when they wrap, so this is exact for them; floats count as real
// numbers, NaN is left out.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "ir/expr.h"

namespace retrograde::analysis {

struct AssociativeOp {
  std::vector<std::string> xs, ys;  // names of the operands' values
  std::vector<Expr> values;         // op, over xs and ys
  std::vector<Expr> identity;       // constants; undefined: any value does
  // op(x, y) == op(y, x), except that which of several equal extremes wins (argmin) may change.
  bool commutative = false;
  // Of equal extremes another may win when the order changes; otherwise nothing changes at all.
  bool breaks_ties = false;
};

struct AssociativityProof {
  std::optional<AssociativeOp> op;
  std::string why_not;              // without op: what is in the way
  std::string why_not_commutative;  // with an op that does not commute
};

// `values`: F, one for each value of the element, over the variables `xs` for its old values;
// everything else in it is a g.
AssociativityProof prove_associative(const std::vector<Expr>& values,
                                     const std::vector<std::string>& xs);

}  // namespace retrograde::analysis
