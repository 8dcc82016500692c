// turned_sums.h -- sums in vectors along a dimension of the result that is not its first, where vectors along the first
// would be nearly empty, or vectors of terms strided.
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
// Sums without private lanes are turned, too, if their first dimension is short, as the taps of a filter are:
//
//   weights(k, c, f) += seed(r, f) * features(r + k, c)       vectors along f, tiles of f and c, all taps k inside of them
//
// There the other operand is copied as well if its elements are used often: borders are then no part of the loop, and
// elements for a tile lie together.
//
// Not done: private lanes of fewer channels than fill three vectors, where strided terms are as fast; private lanes of dense
// terms; sums whose operands all move along the same dimensions, as in a convolution of each channel alone; private parts;
// conditions on the terms of sums without lanes.
#pragma once

#include <optional>
#include <vector>

#include "autoschedule/packed_operand.h"
#include "autoschedule/register_tile.h"
#include "autoschedule/size_estimate.h"
#include "graph/function.h"

namespace retrograde::autoschedule {

struct TurnedSum {
  size_t dimension = 0;  // of the sums, along which vectors run
  int64_t vectors = 1;
  std::vector<RegisterTile::Side> sides;  // elements of the tile along these share the vectors
  std::vector<PackedOperand> copies;      // of what the vectors read, and of other operands
  // Dimensions by their loops outside of a tile, the innermost first: of sums without private lanes.
  std::vector<size_t> outside;

  RegisterTile tile(int lanes) const;
};

// `block` has one private sum for each of so many lanes of terms. nullopt: these are as good.
std::optional<TurnedSum> turned_lanes(const FuncContents& block, int lanes,
                                      const planning::Machine& machine, const SizeEstimate& sizes);
// Of an update without private lanes, of blocks or of all terms; nullopt: other loops are as good. Whoever asks knows that
// vectors along the first dimension of the result would be nearly empty.
std::optional<TurnedSum> turned_sum(const FuncContents& sums, const Definition& update, int lanes,
                                    const planning::Machine& machine, const SizeEstimate& sizes);

}  // namespace retrograde::autoschedule
