// join_steps.h -- moves the nests that step_consumers.h has found into the loop over steps.
//
//   for (i, 0, n): step i                            sum = 0
//   sum = 0                                     =>   for (i, 0, n) {
//   for y, x, (t, 0, n): sum(x, y) += u(x, y, t + 1)   step i
//                                                      for y, x: sum(x, y) += u(x, y, i + 1)
//                                                    }
//
// After that nobody reads all slices of u, so that its storage can be folded.
#pragma once

#include <functional>

#include "lower/loops/step_consumers.h"

namespace retrograde::lower {

// One iteration of a loop of a nest, in place of the loop.
struct OneIteration {
  const For* loop;
  Expr value;              // of the loop's variable
  bool is_checked = true;  // does nothing if the value is not in the loop's range
  bool in_tasks = false;   // if the loop was parallel, another one of the nest becomes so
};
Stmt run_iteration(const Stmt& nest, const OneIteration& one,
                   const std::function<bool(const For&)>& is_pure);

// The Realize of f with its consumers in its steps.
Stmt join_steps(const Realize& f, const TimeSteps& steps, const StepConsumers& consumers,
                const std::function<bool(const For&)>& is_pure);

}  // namespace retrograde::lower
