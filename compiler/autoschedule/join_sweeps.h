// join_sweeps.h -- reductions that load the same run in the same loops, where loads are dear.
//
//   u_adj(x, y) += seed(x, y, r) * along_u(image(i(x, y) + ..., j(x, y) + ..., r))
//   v_adj(x, y) += seed(x, y, r) * along_v(image(i(x, y) + ..., j(x, y) + ..., r))
//
// A vector at places that data decide is loaded lane by lane, and one of a Func larger than caches
// comes from memory, or is computed again. What two such reductions over the same domain load, they
// load once where they run together (compute_with).
#pragma once

#include <unordered_set>
#include <vector>

#include "autoschedule/size_estimate.h"
#include "graph/function.h"

namespace retrograde::autoschedule {

// Of those of the Funcs, all of which this scheduler has given loops, that are at root and have
// nothing computed in their loops. Producers first.
void join_sweeps(const std::vector<FuncPtr>& outputs, const std::vector<FuncPtr>& funcs,
                 const SizeEstimate& sizes);
// Those that it would join as they stand.
std::unordered_set<const Symbol*> sweeps_that_join(const std::vector<FuncPtr>& outputs,
                                                   const std::vector<FuncPtr>& funcs,
                                                   const SizeEstimate& sizes);

}  // namespace retrograde::autoschedule
