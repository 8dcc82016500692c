// tile_chains.h -- what a stage that is tiled reads along whole rows of tiles, is computed for each of
// these rows, with what that reads in turn.
//
//   turned(x, y) = pass(y, x / 2, x % 2)
//
//   for i, k, y: pass = ...                for tiles of y:
//   for tiles of y, x: turned = ...   =>     for i, k, y of the tile: pass = ...
//                                            for tiles of x: turned = ...
//
// No element is computed twice, and of each Func of the chain there is a block for each thread, which
// stays in a cache, where all of it went to memory and back.
#pragma once

#include <unordered_set>
#include <vector>

#include "autoschedule/only_reader.h"
#include "autoschedule/size_estimate.h"
#include "graph/function.h"

namespace retrograde::autoschedule {

// Of the Funcs, all of which this scheduler has given loops, pure primal ones. `but`: none of these.
void compute_in_tiles(const std::vector<FuncPtr>& outputs, const Readers& readers,
                      const std::vector<FuncPtr>& given,
                      const std::unordered_set<const Symbol*>& but, const SizeEstimate& sizes);

}  // namespace retrograde::autoschedule
