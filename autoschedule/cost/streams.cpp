// Processors fetch lines ahead of their use if these lie near each other, in a few streams of addresses. A column of an
// image is a stream for each of its rows:
//
//   for x by 16:  for y:  out(x .. x + 15, y) = ...       each iteration jumps to another row
#include <algorithm>
#include <cmath>

#include "autoschedule/cost/assumptions.h"
#include "autoschedule/cost/terms.h"
#include "autoschedule/machine/reference.h"

namespace retrograde::planning {

namespace {

// Bytes from the elements of one iteration of a loop to those of the next. `inner`, `outer`: the points that the loops
// inside run over, and those with all iterations of the loop.
double step_bytes(const Touch& touch, const Layout& layout, const Cover& inner,
                  const Cover& outer) {
  double sum = 0, row = touch.element_bytes;
  for (const int16_t dimension : layout.order) {
    const TouchedSide& side = touch.sides[static_cast<size_t>(dimension)];
    for (const TouchedSide::Move& move : side.moves) {
      const auto i = static_cast<size_t>(move.iterator);
      if (outer[i] > inner[i]) sum += move.slope / side.divisor * double(inner[i]) * row;
    }
    row *= layout.extents[static_cast<size_t>(dimension)];
  }
  return std::abs(sum);
}

}  // namespace

Streams streams_of(const StageRun& run, const Touch& touch, const StoredBuffer& stored,
                   const Group& group) {
  Streams streams;
  double& count = streams.count;
  double span = 0, reach = 0;  // bytes of a stream, and from the first to the last one
  // Returns whether the loops farther out matter, too.
  const auto add = [&](double step, double trips) {
    if (trips <= 1 || step == 0) return true;
    if (step > span + near_bytes) {
      // Rows that cross the same pages as the last ones, such as those of a turned image, are no new streams.
      if (span >= page_bytes || (touch.data != 0 && step < reach)) return false;
      count *= trips;
      reach += step * (trips - 1);
      return true;
    }
    if (count > 1 && span == 0) streams.visits = std::max(1.0, line_bytes / step);
    if (count > prefetched_streams) return false;
    span += step * (trips - 1);
    return true;
  };
  const Cover& lanes = run.cover.back();
  bool goes_on = add(step_bytes(touch, stored.layout, Cover(lanes.size(), 1), lanes),
                     run.nest.lanes.moves & touch.moved ? run.nest.lanes.count : 1);
  for (size_t k = run.path.size(); goes_on && k-- > stored.inside;) {
    goes_on = add(step_bytes(touch, stored.layout, run.cover[k + 1], run.cover[k]),
                  group.nodes[static_cast<size_t>(run.path[k])].trips);
  }
  streams.lines = std::max(1.0, span / double(line_bytes));
  return streams;
}

}  // namespace retrograde::planning
