// sum_rewrites.h -- the forms of sums that no schedule can give, made before a graph is scheduled: costly factors
// become Funcs (invariant_factors.h), and zeros between elements are left out (strided_terms.h).
#pragma once

#include <vector>

#include "autoschedule/factored_graph.h"
#include "graph/function.h"

namespace retrograde::autoschedule {

// The outputs of a graph with these sums. `outputs`, whose wrappers have been applied, and its Funcs stay as they are;
// the new graph shares those that are alike.
std::vector<FuncPtr> with_rewritten_sums(const std::vector<FuncPtr>& outputs,
                                         SumOrder order = SumOrder::Kept);

}  // namespace retrograde::autoschedule
