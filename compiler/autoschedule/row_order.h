// row_order.h -- a reduction over many planes of a Func larger than the caches goes along their rows.
//
//   sums(x, y) += planes(x, y, r)
//
//   for y, x:                              for y:
//     for r: sums += planes(x, y, r)   =>    for r, x: sums += planes(x, y, r)
//
// Element after element, each iteration reads another plane: more streams than a processor fetches
// ahead. Along a row there is one at a time, and the row of sums stays in the nearest cache.
#pragma once

#include <vector>

#include "autoschedule/size_estimate.h"
#include "graph/function.h"

namespace retrograde::autoschedule {

// Of those of the Funcs, all of which this scheduler has given loops, that are at root.
void run_along_rows(const std::vector<FuncPtr>& funcs, const SizeEstimate& sizes);

}  // namespace retrograde::autoschedule
