#include "autoschedule/cost/group.h"

#include <algorithm>
#include <cmath>

#include "autoschedule/plan/nest.h"

namespace retrograde::planning {

namespace {

class TripCounter {
 public:
  TripCounter(const Nest& nest, const Cover& extents) : nest_(nest), extents_(extents) {}

  // Vectors and unrolled loops run in full. The last iteration of a serial loop may be shorter, so that a step outside of
  // it has fewer points in the mean.
  double trips(const Part& part, bool is_full) const {
    if (part.iterator == once) return 1;
    const double count = range(part) / static_cast<double>(part.step);
    if (is_full) {
      const Part* larger = next_larger(nest_, part.iterator, part.step);
      return std::ceil(larger ? double(larger->step) / double(part.step) : count);
    }
    return part.step == 1 ? count : std::ceil(count);
  }
  IteratorSet moves(int iterator) const {
    if (iterator == once) return 0;
    if (iterator < base_count()) return set_of(iterator);
    const Fusion& f = fusion(iterator);
    return moves(f.inner.iterator) | moves(f.outer.iterator);
  }
  LaneLoop lanes(const Loop& loop) const {
    LaneLoop result;
    result.count = result.inner = trips(loop, true);
    result.moves = moves(loop.iterator);
    result.step = static_cast<double>(loop.step);
    const Part* part = &loop;
    while (part->iterator >= base_count()) {
      const Fusion& f = fusion(part->iterator);
      const double inner = trips(f.inner, true);
      if (inner < result.inner && f.outer.iterator < base_count()) {
        result.outer = f.outer.iterator;
        result.inner = inner;
      }
      part = &f.inner;
      result.step *= static_cast<double>(part->step);
    }
    result.iterator = part->iterator;
    return result;
  }

 private:
  const Nest& nest_;
  const Cover& extents_;

  int base_count() const { return static_cast<int>(extents_.size()); }
  const Fusion& fusion(int iterator) const {
    return nest_.fusions[static_cast<size_t>(iterator - base_count())];
  }
  double extent(int iterator) const {
    if (iterator < base_count())
      return static_cast<double>(std::max<int64_t>(extents_[static_cast<size_t>(iterator)], 1));
    return trips(fusion(iterator).inner, false) * trips(fusion(iterator).outer, false);
  }
  // The points that all iterations of a part run over.
  double range(const Part& part) const {
    const Part* larger = next_larger(nest_, part.iterator, part.step);
    if (!larger) return extent(part.iterator);
    return std::min(double(larger->step), range(*larger) / trips(*larger, false));
  }
};

}  // namespace

NestTrips nest_trips(const Nest& nest, const Cover& extents) {
  const TripCounter counter(nest, extents);
  NestTrips result;
  result.is_atomic = nest.concurrency == Concurrency::Atomic;
  for (const Loop& loop : nest.loops) {
    const bool is_lane = loop.kind == ForType::Vectorized || loop.kind == ForType::GpuLane;
    result.trips.push_back(
        std::max(1.0, counter.trips(loop, is_lane || loop.kind == ForType::Unrolled)));
    result.moves.push_back(counter.moves(loop.iterator));
    if (is_lane) {
      result.lanes = counter.lanes(loop);
      result.lanes.depth = static_cast<int>(result.trips.size()) - 1;
    }
  }
  return result;
}

}  // namespace retrograde::planning
