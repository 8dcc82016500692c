// point_loops.h -- loops of Funcs over many points with a few numbers each (point_funcs.h).
//
//   for i:                                   for i by 16:
//     for r, k:                                for r:
//       for j in vectors: blended += ...  =>     for k, j, unrolled:
//                                                  for 16 values of i in a vector: blended += ...
//
// Copies for j and k share what they read, and their sums stay in registers, which start in them. All stages of a Func
// share the loop over points, and what a single stage of such a Func reads at its own points is computed in this loop.
// Stores of copies next to each other become whole vectors (lower/vectors/interleave_vectors.cpp).
// Tests: test/autoschedule/point_loops_test.cpp.
#pragma once

#include <vector>

#include "autoschedule/only_reader.h"
#include "autoschedule/point_funcs.h"
#include "autoschedule/register_tile.h"

namespace retrograde::autoschedule {

// Of a Func that is computed at root.
void give_point_loops(const FuncPtr& f, const PointFuncs& points, int lanes,
                      const planning::Machine& machine, const SizeEstimate& sizes);

// Moves those of the Funcs that one stage of another reads at its own points. `excluded`: none of these.
void compute_at_points(const std::vector<FuncPtr>& funcs, const PointFuncs& points,
                       const Readers& readers, const std::unordered_set<const Symbol*>& excluded);

}  // namespace retrograde::autoschedule
