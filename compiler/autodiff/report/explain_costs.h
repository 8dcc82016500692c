// explain_costs.h -- the part of Derivative::explain() that depends on schedules: what a gradient stores, recomputes
// and leaves out, with bytes and operations.
#pragma once

#include <vector>

#include "autodiff/report/explain.h"
#include "autodiff/report/operation_count.h"

namespace retrograde::autodiff {

// `primal` and `gradient` are the counts of the outputs alone and of the gradients alone. The facts list Funcs in the
// order in which the gradient computes them, then Funcs that it does not need, then the totals. A note follows if the
// gradient stores more than twice the intermediate results of the program.
std::vector<Explanation> explain_costs(const std::vector<WantedFunc>& outputs,
                                       const std::vector<WantedFunc>& gradients,
                                       const OperationCount& primal,
                                       const OperationCount& gradient);

}  // namespace retrograde::autodiff
