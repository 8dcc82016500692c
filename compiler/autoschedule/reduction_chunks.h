// reduction_chunks.h -- how much of a long reduction all tiles of its sums do before any of them goes on.
//
//   sums(k, c) += image(x, y, k) * delta(x, y, c)
//
//   for tiles of k, c:                        for chunks of y:
//     for y:                                    for tiles of k, c:
//       for x: a tile of sums += ...    =>        for y in the chunk:
//                                                   for x: a tile of sums += ...
//
// Sums that are added up in tiles without blocks have chunks of the outermost loops of their reduction in the same way.
//
// A tile that runs over all of the images fetches them from memory, as every other tile does again. A
// chunk of them stays in a cache until all tiles have used it. Each sum is added up in the order that
// it had.
// Source: the blocked loop over the inner dimension of a matrix product (K. Goto and R. van de Geijn,
// Anatomy of High-Performance Matrix Multiplication, ACM TOMS 34 (2008), section 4), for any reads that
// are linear.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "autoschedule/register_tile.h"

namespace retrograde::autoschedule {

// The largest number of iterations, at most `most`, that divides a loop without a rest.
int64_t largest_part(int64_t extent, int64_t most);

// The dimension of a block that a loop of its sums moves alone.
std::optional<size_t> number_along(const FuncContents& sums, const FuncContents& block,
                                   const std::string& loop);

// Of `sums`, whose update adds up what `block` computes for one iteration of the loop, in tiles: the
// iterations of a chunk, a divisor of all. nullopt: the tiles read little again, or sizes are not
// known.
std::optional<int64_t> reduction_chunk(const FuncContents& sums, const FuncContents& block,
                                       const ReductionVariable& loop, const RegisterTile& tile,
                                       int lanes, const SizeEstimate& sizes);

// The loops of a reduction outside of those over tiles.
struct TermChunk {
  size_t loop = 0;         // by reduction_loops(): those that follow are outside
  int64_t iterations = 0;  // of this one, of which the rest is outside; 0: all of it stays inside
};
// The chunk for a sum whose first update has the tile. nullopt: the tiles read little again, or sizes are not known.
std::optional<TermChunk> chunk_of_terms(const FuncContents& sums, const RegisterTile& tile,
                                        int lanes, const SizeEstimate& sizes);

}  // namespace retrograde::autoschedule
