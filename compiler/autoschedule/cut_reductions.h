// cut_reductions.h -- sums over a whole domain, to one element or a few, in lanes and parts.
//
//   loss() += e(r.x, r.y)     =>    parts(lane, row) += e(16 t + lane, row)
//                                   sums(lane, i) += parts(lane, 32 s + i)
//                                   loss() += sums(lane, i)
//
// A reduction to one element, or to a few, has no loop that could be vectorized or run in parallel,
// and one chain of float32 additions loses digits with its length: of 12 million terms it is off by
// 2 %. The cut depends on the program alone, so that results are the same bits for every number of
// threads.
#pragma once

#include <unordered_set>
#include <vector>

#include "autoschedule/size_estimate.h"
#include "graph/function.h"

namespace retrograde::autoschedule {

// Factors long associative updates of one element, or of a number that is known to be small
// (rfactor.h), of Funcs of this graph that nobody scheduled. `but`: not of these.
void cut_reductions(const std::vector<FuncPtr>& outputs, const SizeEstimate& sizes,
                    const std::unordered_set<const Symbol*>& but = {});

}  // namespace retrograde::autoschedule
