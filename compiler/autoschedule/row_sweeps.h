// row_sweeps.h -- sums over a domain and Funcs over it that read the same run in one loop over rows.
//
//   curve(x, y, c) = pow(image(x, y, c), gamma())            larger than caches
//   loss() += square(curve(r.x, r.y, r.z) - target(r.x, r.y, r.z))
//   gamma_adj() += ... curve(...) ...
//   image_adj(x, y, c) = ... curve(x, y, c) ...
//
//                        parallel for y:
//                          for c, x: curve = ...             a row of it, that stays in the cache
//                 =>       for c, x: image_adj = ...
//                          for c, x, lane: loss_rows(lane, y) += ...
//                          for c, x, lane: gamma_adj_rows(lane, y) += ...
//
// What was stored as a whole and loaded by each of them goes neither way to memory, and what else
// they read is loaded once. All sums are cut alike, into lanes and rows (cut_reductions.h): the
// private parts of an adjoint, each a range of rows, into their rows. Cuts depend on the program
// alone, so that results have the same bits for every number of threads.
#pragma once

#include <unordered_set>
#include <vector>

#include "autoschedule/size_estimate.h"
#include "graph/function.h"

namespace retrograde::autoschedule {

// Schedules such stages and what they read so. `stored`: the Funcs to be at root, which have no loops
// yet; those that get theirs here are taken out. `but`: none of these.
void sweep_rows(const std::vector<FuncPtr>& outputs, std::vector<FuncPtr>& stored,
                const std::unordered_set<const Symbol*>& but, const SizeEstimate& sizes);

}  // namespace retrograde::autoschedule
