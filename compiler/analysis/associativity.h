// associativity.h -- proves that an update combines elements by an associative operator.
//
// An update replaces the values x of an element by F(x, g), where g does not depend on x. The proof
// finds an operator op on elements and a constant id with F(x, g) == op(x, F(id, g)), where op is
// associative and id its identity. Partial results that each start from id may then be combined.
//
//   F(x, g) = x + g                                        op(x, y) = x + y         id = 0
//   F(x, g) = {min(x0, g0), select(g0 < x0, g1, x1)}       the same with y for g    {inf, any}
//   F(x, g) = {x0 * g0 - x1 * g1, x0 * g1 + x1 * g0}       the same with y for g    {1, 0}
//
// Method: candidates come from a table of operators, and from F itself with parts of y in place of
// g. A candidate is accepted only when its laws are proven. Comparisons are decided by a case for
// every order of the compared values. In each case both sides are polynomials with integer
// coefficients (or bits, for bitwise operators), which are equal when their normal forms are. This
// is exact for integers, which form a ring because they wrap. Floats are treated as real numbers,
// without NaN.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "ir/expr.h"

namespace retrograde::analysis {

struct AssociativeOp {
  std::vector<std::string> xs, ys;  // names of the operands' values
  std::vector<Expr> values;         // op, over xs and ys
  std::vector<Expr> identity;       // constants; undefined: any value is correct
  // op(x, y) == op(y, x), except that another one of several equal extremes may win (argmin).
  bool commutative = false;
  // Whether reordering may change which of several equal extremes wins; otherwise it changes
  // nothing.
  bool breaks_ties = false;
};

struct AssociativityProof {
  std::optional<AssociativeOp> op;
  std::string why_not;              // when op is missing: the obstacle
  std::string why_not_commutative;  // when op does not commute
};

// `values` is F: one expression per value of the element, over the variables `xs` for its old
// values. Everything else in it belongs to g.
AssociativityProof prove_associative(const std::vector<Expr>& values,
                                     const std::vector<std::string>& xs);

}  // namespace retrograde::analysis
