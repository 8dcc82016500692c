// step_accesses.h -- bounds the elements that the threads of a block access in a step (insert_barriers): an interval of
// indices that holds for all threads.
//
//   for (r, 1, n) {
//     gpu_thread for (x, 0, 16) { f[16 * r + x] = g[x] }    stores f [16 * r, 16 * r + 15], reads g [0, 15]
//   }
#pragma once

#include <string>
#include <unordered_map>
#include <vector>

#include "ir/interval.h"
#include "ir/visit.h"
#include "simplify/facts.h"

namespace retrograde::lower {

// All loads, or all stores, that a step makes to one allocation.
struct Access {
  std::string name;
  bool stores = false;
  Interval
      elements;  // in terms of loops around the step and values known outside; undefined: unknown
};

// The lets and serial loops around a step.
class StepSurroundings {
 public:
  void define(const LetStmt& let) { lets_[let.name] = let.value; }
  void enter(const For& loop);
  void leave(const For& loop);

  std::vector<Access> accesses_of(const Stmt& step);

  // The access one iteration of `loop` earlier, and the access in any iteration of it.
  static Access one_iteration_earlier(const Access& access, const For& loop);
  Access in_any_iteration(const Access& access, const For& loop) const;

  // Whether the two accesses have no element in common.
  bool can_prove_apart(const Access& a, const Access& b);
  bool can_prove_runs(const For& loop);

 private:
  Interval range_of(const For& loop) const;
  bool can_prove_below(const Expr& a, const Expr& b);
  bool can_prove_apart(const Interval& a, const Interval& b);

  Substitution lets_;
  std::vector<const For*> loops_;  // outermost first
  simplification::Facts facts_;
  // Accesses by step, in terms of the names directly around it; cached because a step is visited more than once.
  std::unordered_map<const void*, std::pair<Stmt, std::vector<Access>>> found_;
};

}  // namespace retrograde::lower
