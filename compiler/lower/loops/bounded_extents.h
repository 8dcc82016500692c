// bounded_extents -- finds constant upper bounds of loop extents, for passes that need a constant.
//
//   for (x, 0, n) {                                     // y runs at most 4 times: the bound follows from
//     let m = min(n - x * 4, 4)                   =>    // the range of x, the value of m and the condition
//     if (m < 5) { unrolled for (y, 0, m) ... }
//   }
//
// Method: expands lets in the extent, then bounds it; each arm of a select is bounded under its own condition.
#pragma once

#include <optional>
#include <vector>

#include "lower/statement_rewriter.h"
#include "simplify/facts.h"

namespace retrograde::lower {

// A rewriter of statements that knows the loops, lets and conditions around the current statement.
class BoundedExtents : public StatementRewriter {
 protected:
  // Rewrites the parts of the statement. Derived classes call it first.
  Stmt parts(const Stmt& s);
  // A constant upper bound of the extent at the current statement; nullopt if none of at most `most` is known.
  std::optional<int64_t> largest(const Expr& extent, int64_t most) const;
  // Whether the extent mentions at most `names` names, counting those in the values of its lets.
  bool mentions_few_names(const Expr& extent, int names) const;

 private:
  Substitution values_;            // of lets around the current statement, not expanded
  std::vector<const For*> loops_;  // around it
  std::vector<Expr> conditions_;   // that hold there

  Stmt chosen(const IfThenElse& choice);
  bool count_names(const Expr& e, int& left) const;
};

}  // namespace retrograde::lower
