// What a gradient keeps in memory, what it computes again and what it leaves out, with bytes and
// operations: the part of Derivative::explain() that depends on schedules.
#pragma once

#include <vector>

#include "autodiff/report/explain.h"
#include "autodiff/report/operation_count.h"

namespace retrograde::autodiff {

// `primal` and `gradient`: counts of the output alone, and of the gradients alone. Funcs in the
// order in which the gradient computes them, then what it needs nothing of, then the sums; where it
// keeps more than twice what the program does on its way, that too.
std::vector<Explanation> explain_costs(const WantedFunc& output,
                                       const std::vector<WantedFunc>& gradients,
                                       const OperationCount& primal,
                                       const OperationCount& gradient);

}  // namespace retrograde::autodiff
