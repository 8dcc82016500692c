// terms.h -- the terms of a group's price: what each stage computes, and the bytes that move between caches and memory.
#pragma once

#include <vector>

#include "autoschedule/cost/cost.h"
#include "autoschedule/cost/group.h"

namespace retrograde::planning {

inline constexpr double nanosecond = 1e-9;  // in seconds

// Nanoseconds of one thread that each kind of unit of a core is busy. They work at the same time.
struct UnitTimes {
  double arithmetic = 0, loads = 0, stores = 0, scalars = 0;
  double loops = 0;    // counts iterations
  double fetches = 0;  // instructions of a body that is larger than their cache
  double chain = 0;    // operations of which each waits for the one before
  double meeting = 0;  // additions at places that data decide, if each waited for the one before
  double starts =
      0;  // of slices, whose first loads wait for the stores to them, and of parallel iterations
  double code = 0;     // instructions, in all unrolled copies: how often they run counts nothing
  double all() const;  // with what they cannot overlap
};
// All iterations of a stage on one thread, if all its data are in the first cache.
UnitTimes work_of(const StageRun& run, const Group& group, const Machine& machine);

// The addresses that a stage walks along in a buffer, one beside the other.
struct Streams {
  double count = 1;
  double lines = 1;   // of cache, that follow each other until the next stream has its turn
  double visits = 1;  // of a line, with those of the other streams between them
};
Streams streams_of(const StageRun& run, const Touch& touch, const StoredBuffer& stored,
                   const Group& group);

// The bytes of a buffer that a stage fetches from behind a cache, and writes back.
struct BufferTraffic {
  int run = 0, buffer = 0;
  double bytes = 0;
  double first_bytes =
      0;  // of these, what would not have to be moved if the buffer were in the cache before
  double waiting_ns = 0;  // for lines that nothing fetched ahead, all together
  bool in_parallel = false;
};
struct GroupTraffic {
  std::array<std::vector<BufferTraffic>, Machine::level_count - 1> behind;  // by cache
  std::vector<std::pair<int, double>> touched;  // each buffer with its bytes, the largest first
};
GroupTraffic traffic_of(const Group& group, const Machine& machine);

// ---- devices ----

bool has_kernels(const Group& group);
// The time and the bytes of a stage that is a kernel, or that runs in the loops of one.
StageCost kernel_cost(const StageRun& run, const Group& group, const Device& device,
                      const Machine& machine);

}  // namespace retrograde::planning
