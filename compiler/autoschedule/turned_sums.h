// turned_sums.h -- blocks of long sums in vectors along a dimension of the result, where vectors of terms would be strided.
//
//   block(lane, k, c, f) += seed(2 * (16 * r + lane) + k, f) * features(16 * r + lane, c)           a gradient by weights
//
//   for tiles of c, f:                            copy(c, x) = features(x, c)
//     for r:                                      for tiles of c, f:
//       16 lanes: a tile of c, f += strided   =>    for lane:
//                 vectors of seed * vectors           for r: a tile of c, f += elements of seed * vectors of copy along c
//                 of features
//
// A strided vector takes several loads and a shuffle for each product of a few; single elements take a broadcast, whatever
// their stride. Each sum has the terms and the order that it has with lanes of terms, so results have the same bits.
// The copy is transposed and dense. It is made once, before the sums.
//
// Not done: fewer channels than fill three vectors, where strided terms are as fast; sums of few terms, which have no blocks;
// reads that are dense along the terms; sums whose operands all move along the same dimensions, as in a
// convolution of each channel alone; private parts.
#pragma once

#include <optional>
#include <vector>

#include "autoschedule/packed_operand.h"
#include "autoschedule/register_tile.h"
#include "autoschedule/size_estimate.h"
#include "frontend/schedule/stage.h"
#include "graph/function.h"

namespace retrograde::autoschedule {

struct TurnedSum {
  size_t dimension = 0;  // of the block, along which vectors run
  size_t side = 0;       // of the block: the elements of the tile along it share the vectors
  int64_t vectors = 1, side_size = 1;
  PackedOperand operand;  // what the vectors read

  RegisterTile tile(int lanes) const;
};

// `block` has one private sum for each of so many lanes of terms. nullopt: these are as good.
std::optional<TurnedSum> turned_sum(const FuncContents& block, int lanes, const VectorUnit& unit,
                                    const SizeEstimate& sizes);

// Loops of the stages of the block, which is computed in loops of `sums`, and of the update of `sums`, which adds blocks in
// double. `between`: loops that stand just inside of those of the reduction. Returns the loops over tiles.
std::vector<VarOrRVar> give_turned_loops(const FuncPtr& sums, const FuncPtr& block,
                                         const TurnedSum& turned, const std::vector<Var>& between,
                                         int lanes);

// Loops of an update that adds lanes of such sums, along the rows that these have; false: it adds something else.
bool add_turned_lanes(const FuncPtr& f, int index, int lanes);

}  // namespace retrograde::autoschedule
