// sum_blocks.h -- what a sum that is added up in tiles gives to one pure Func alone, is computed a
// block at a time, in the loops of that Func.
//
//   convolved(x, y, c) += ...;  result(x, y, c) = max(convolved(x, y, c), 0)
//
//   parallel for blocks of y:                 parallel for blocks of y:
//     for y of the block, tiles of c, x:        for y of the block, tiles of c, x:
//       convolved += ...                  =>      convolved += ...
//   parallel for c, y, x: result = ...          for c, y of the block, x: result = ...
//
// The loops over blocks are the outermost of those over tiles, as many as make blocks that stay in a near
// cache, in which the reader finds them; the sum went to memory and back. No element is computed twice.
#pragma once

#include <unordered_set>
#include <vector>

#include "autoschedule/only_reader.h"
#include "autoschedule/size_estimate.h"
#include "graph/function.h"

namespace retrograde::autoschedule {

// Moves those of `given`, which this scheduler has computed at root and given loops, into the loops
// of their only reader, if that is one of them, too. `readers`: before their loops were given, for what
// a sum's loops copy for its tiles moves with it. `but`: none of these, as a reader neither.
void compute_sums_in_blocks(const std::vector<FuncPtr>& outputs, const Readers& readers,
                            const std::vector<FuncPtr>& given,
                            const std::unordered_set<const Symbol*>& but,
                            const SizeEstimate& sizes);

}  // namespace retrograde::autoschedule
