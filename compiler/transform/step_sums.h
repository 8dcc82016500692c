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

#include "graph/function.h"
#include "transform/size_estimate.h"

namespace retrograde::transform {

// Adjoints whose steps are large together and small alone.
struct StepSums {
  std::unordered_set<const Symbol*> sums;   // of that form
  std::unordered_set<const Symbol*> steps;  // the steps, and Funcs between them and their sums
};
StepSums step_sums(const std::vector<FuncPtr>& outputs, const SizeEstimate& sizes);

}  // namespace retrograde::transform
