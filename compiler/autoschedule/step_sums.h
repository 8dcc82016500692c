// step_sums.h -- sums over the steps of a loop over time, which stay at root.
//
//   u(r.x, r.y, r.t + 1) = ...                                   the steps
//   sum(x, y) += u(x, y, t + 1) * v(x, y, t)   over t
//
// Lowering adds the terms of a step right after the step (lower/loops/join_steps.h), so that not all steps need to be
// stored. It cannot if the sum is computed in the loops of its consumer, which run over x and y.
#pragma once

#include <unordered_set>
#include <vector>

#include "autoschedule/size_estimate.h"
#include "graph/function.h"

namespace retrograde::autoschedule {

// The adjoints of that form whose steps are large together and small alone.
std::unordered_set<const Symbol*> step_sums(const std::vector<FuncPtr>& outputs,
                                            const SizeEstimate& sizes);

}  // namespace retrograde::autoschedule
