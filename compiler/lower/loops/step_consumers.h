// step_consumers.h -- finds the loop nests after a loop over steps that can run within it: each of their iterations over
// time reads slices that are finished in one step, or a few steps before.
//
//   for (i, 0, n): u(.., i + 1) = ...                     the steps
//   for y, x, (t, 0, n): sum(x, y) += u(x, y, t + 1)      iteration t can run after step t
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "lower/loops/step_nests.h"

namespace retrograde::lower {

struct StepConsumers {
  std::vector<Stmt>
      before;  // moves before the steps: producers of the nests, and the first values of their sums
  std::vector<StepNest> nests;
  std::vector<const StmtNode*> moved;  // all statements that leave their places
  std::vector<Stmt> around;  // Realizes and LetStmts that must enclose the steps, outermost first
  // Funcs of which a few slices are read, all of them in the steps: the dimension and the number of slices.
  struct Fold {
    std::string func;
    size_t dimension;
    int64_t slots;
  };
  std::vector<Fold> folds;
};

// The consumers of a Func with steps that can run within them; nullopt if there are none. `lets`: the names around the
// Realize with their expanded values. `may_move`: whether the statements of the Func of that name may move.
std::optional<StepConsumers> find_step_consumers(
    const Realize& f, const TimeSteps& steps, const Substitution& lets,
    const std::function<bool(const std::string&)>& may_move);

}  // namespace retrograde::lower
