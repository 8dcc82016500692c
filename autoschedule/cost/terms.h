// terms.h -- the terms of a group's price: what each stage computes, and the bytes that move between caches and memory.
#pragma once

#include <vector>

#include "autoschedule/cost/group.h"

namespace retrograde::planning {

// Nanoseconds of one thread that each kind of unit of a core is busy. They work at the same time.
struct UnitTimes {
  double arithmetic = 0, loads = 0, stores = 0, scalars = 0;
  double loops = 0;    // counts iterations
  double chain = 0;    // operations of which each waits for the one before
  double all() const;  // with what they cannot overlap
};
// All iterations of a stage on one thread, if all its data are in the first cache.
UnitTimes work_of(const StageRun& run, const Group& group, const Machine& machine);

// The bytes of a buffer that a stage fetches from behind a cache, and writes back.
struct BufferTraffic {
  int run = 0, buffer = 0;
  double bytes = 0;
  double first_bytes =
      0;  // of these, what would not have to be moved if the buffer were in the cache before
  bool in_parallel = false;
};
struct GroupTraffic {
  std::array<std::vector<BufferTraffic>, Machine::level_count - 1> behind;  // by cache
  std::vector<std::pair<int, double>> touched;  // each buffer with its bytes, the largest first
};
GroupTraffic traffic_of(const Group& group, const Machine& machine);

}  // namespace retrograde::planning
