// row_copies.h -- what a tile of sums reads through an inlined Func again and again, such as a boundary
// condition, is computed once for whole rows of tiles.
//
//   sums(x, y, c) += weights(r.x, r.y, r.z, c) * padded(x + r.x - 1, y + r.y - 1, r.z)
//
//   for y, tiles of c, tiles of x:             for y:
//     for r: a tile of sums +=           =>      for r.z, three rows, x: copy = padded(...)
//       ... * (inside ? image(...) : 0)          for tiles of c, tiles of x:
//                                                  for r: a tile of sums += ... * copy(...)
//
// The tiles read rows that lie together, without conditions at the borders, and each thread holds a
// few rows of all planes in a near cache. Where sizes are known, several rows of the result share one
// copy, so that fewer rows are copied twice.
// Cost: a copy saves, for each of its elements, what the tiles' reads would compute beyond a load, and
// takes a way to a near cache. Both are counted for the rows of one copy; of sizes that are not known
// only their ratios matter.
//
// A read that stays inside of where the border begins gets no copy, as a seed's over its own box.
//
// The same is done for blocks of a long sum (autodiff/sums/blocked_sums.h), as of a convolution's gradient
// by its weights, whose tiles run over chunks of it (reduction_chunks.h): a copy is of a chunk then.
#pragma once

#include <optional>
#include <vector>

#include "autoschedule/register_tile.h"
#include "frontend/schedule/loop_level.h"

namespace retrograde::autoschedule {

struct RowCopy {
  FuncPtr source;
  size_t dimension = 0;  // of the Func: each iteration of the loop over its tiles has its own copy
  int64_t rows = 1;      // tiles along it that share one
};

// Dimensions of a Func.
struct LoopsOfTiles {
  std::vector<size_t> tiles;   // by the order of the loops over tiles, the innermost first
  std::vector<size_t> inside;  // of which all is done for one tile before the next one
};

// The inlined Func that the only update of f reads, and is worth it, when the update has the tile;
// nullopt: none. Other dimensions than those of the loops stay where they are while a copy is in use.
std::optional<RowCopy> row_copy(const FuncContents& f, const RegisterTile& tile, int lanes,
                                const LoopsOfTiles& loops, const SizeEstimate& sizes);
// The loop may be of another Func, in whose loops f is computed.
void copy_rows(const FuncPtr& f, const RowCopy& copy, const retrograde::LoopLevel& loop, int lanes);

}  // namespace retrograde::autoschedule
