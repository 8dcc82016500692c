// column_blocks.h -- scans of which one Func alone reads each column by itself run in the loops of that
// Func, a block of columns at a time.
//
//   sums(x, r) = sums(x, r - 1) + in(x, r);  turned(x, y) = sums(y, x)
//
//   parallel for blocks of x: for r, x: sums = ...        parallel for blocks of y:
//   parallel for tiles of y, x: turned = ...          =>    for r, columns of the block: sums = ...
//                                                           for tiles of y, x: turned = ...
//
// No element is computed twice, and a block stays in a cache between the stages of the scan and its
// reader, where all of it went to memory and back for each.
#pragma once

#include <unordered_set>
#include <vector>

#include "autoschedule/only_reader.h"
#include "autoschedule/size_estimate.h"
#include "graph/function.h"

namespace retrograde::autoschedule {

// Of the Funcs, which this scheduler has computed at root and given loops, the scans.
// `but`: none of these, as a reader neither.
void compute_in_column_blocks(const Readers& readers, const std::vector<FuncPtr>& stored,
                              const std::unordered_set<const Symbol*>& but,
                              const SizeEstimate& sizes);

}  // namespace retrograde::autoschedule
