// bounded_extents -- constants above the extents of loops, for passes that need one.
//
//   for (x, 0, n) {                                     // y runs at most 4 times, by the ends of x,
//     let m = min(n - x * 4, 4)                   =>    // the value of m, and the condition
//     if (m < 5) { unrolled for (y, 0, m) ... }
//   }
//
// Method: the extent in terms of the outermost names; each arm of a select is bounded under its own
//         condition.
#pragma once

#include <optional>
#include <vector>

#include "lower/statement_rewriter.h"
#include "simplify/facts.h"

namespace retrograde::lower {

// A rewriter of statements that knows what holds at the loop at hand.
class BoundedExtents : public StatementRewriter {
 protected:
  // With its parts rewritten: derived classes call it first.
  Stmt parts(const Stmt& s);
  // A constant that the extent does not exceed where the statement at hand runs; none when there is
  // none up to `most`.
  std::optional<int64_t> largest(const Expr& extent, int64_t most) const;
  // Whether the extent is made of at most so many names, those in the values of its names included.
  bool is_made_of_few(const Expr& extent, int names) const;

 private:
  Substitution values_;            // of names around the statement at hand, as they are written
  std::vector<const For*> loops_;  // around it
  std::vector<Expr> conditions_;   // that hold there

  Stmt chosen(const IfThenElse& choice);
  bool takes_names(const Expr& e, int& left) const;
};

}  // namespace retrograde::lower
