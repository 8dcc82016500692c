// cover.h -- the points of its iterators that a piece of a stage's nest covers, and the box that it accesses.
//
//   y:8, x:16, y, x        one iteration of the loop over x in steps of 16 covers 16 points of x and 8 of y
//   f(x + r, y / 2)        with r in [0, 3), it accesses a box of 18 by 4 elements
//
// The points of an iterator are consecutive. Where an index is divided, the first is a multiple of how many they are,
// counted from the first point of the whole loop: that is how steps lie.
#pragma once

#include <cstdint>
#include <vector>

#include "autoschedule/access/sizes.h"

namespace retrograde::planning {

// Points of each iterator of a stage; 1 where it stands still. In the functions below it belongs to the stage that
// accesses.
using Cover = std::vector<int64_t>;

// All points of all iterators, at least 1 of each.
Cover whole_cover(StageId stage, const SizeModel& sizes);
// The same, with a box of elements, by dimension of the Func, for the pure iterators.
Cover cover_of_box(StageId stage, const std::vector<int64_t>& box, const SizeModel& sizes);

// The extents in elements, by dimension of what is accessed, of the box that the access needs. A data-dependent part of
// an index takes all values of its range. No extent is larger than that of the whole dimension.
std::vector<int64_t> extents(const Access& access, const Cover& cover, const SizeModel& sizes);
// Those of the box that holds all these accesses of one stage to one Func or image. Indices that drift apart, as x and
// 2 * x do, need all that lies between them in the whole loop.
std::vector<int64_t> extents(const std::vector<const Access*>& accesses, const Cover& cover,
                             const SizeModel& sizes);

}  // namespace retrograde::planning
