// traffic.h -- the bytes that a group of stages moves between the caches and memory.
//
// The outermost loops whose run fits into a cache load what they touch once. Loops of which one iteration fits do, too:
// what iterations share, such as the rows of a stencil, is used again while it is there. Farther out, all is loaded anew.
// Source: Wolf and Lam, "A Data Locality Optimizing Algorithm" (PLDI 1991).
#pragma once

#include <vector>

#include "autoschedule/cost/group.h"

namespace retrograde::planning {

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
