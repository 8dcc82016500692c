// step_accesses.h -- which elements of storage the threads of a block touch in a step (insert_barriers):
// an interval of places in the storage, whatever the thread.
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

// All that a step touches of one storage, in one way.
struct Access {
  std::string name;
  bool stores = false;
  Interval
      elements;  // by loops around the step, and what is outside of the kernel; undefined: unknown
};

// What is around a step: names, and serial loops.
class StepSurroundings {
 public:
  void define(const LetStmt& let) { lets_[let.name] = let.value; }
  void enter(const For& loop);
  void leave(const For& loop);

  std::vector<Access> accesses_of(const Stmt& step);

  // The same of the iteration before, and of all iterations, of a loop around it.
  static Access one_iteration_earlier(const Access& access, const For& loop);
  Access in_any_iteration(const Access& access, const For& loop) const;

  // Whether no element of one is one of the other's.
  bool can_prove_apart(const Access& a, const Access& b);
  bool can_prove_runs(const For& loop);

 private:
  Interval range_of(const For& loop) const;
  bool can_prove_below(const Expr& a, const Expr& b);
  bool can_prove_apart(const Interval& a, const Interval& b);

  Substitution lets_;
  std::vector<const For*> loops_;  // outermost first
  simplification::Facts facts_;
  // By step, in terms of the names directly around it: a step is looked at more than once.
  std::unordered_map<const void*, std::pair<Stmt, std::vector<Access>>> found_;
};

}  // namespace retrograde::lower
