// memory_traffic.h -- how many bytes of what a function touches come from behind a cache.
//
// Of each loop it is known how much its whole run touches. The outermost loops whose run stays within
// the cache load that once; what iterations of the loop around share, as the rows of a stencil are,
// stays too, since it is used again soon enough. Farther out everything is loaded anew, but for what
// was touched so recently that it is still there. The call is one of many: what the last one left
// counts. This is the view of tiled loops by footprints and distances of reuse that Wolf and Lam's
// "A Data Locality Optimizing Algorithm" (PLDI 1991) and its successors have.
#pragma once

#include <vector>

#include "tuning/work_tree.h"

namespace retrograde::tuning {

// Of one stage.
struct Traffic {
  double serial_bytes = 0, parallel_bytes = 0;  // outside of and in parallel loops
};

class MemoryTraffic {
 public:
  explicit MemoryTraffic(const WorkTree& tree);
  // By stage; bytes that are stored count twice: they are loaded before.
  std::vector<Traffic> behind(double cache_bytes) const;
  // What all of a node's run touches, and one iteration.
  double run_bytes(int node) const;

 private:
  struct Region {
    int buffer = 0, stage = 0;
    bool is_stored = false, in_parallel = false;
    double bytes = 0, low = 0, high = 0;
  };
  struct Group;
  struct Recent;
  class Walk;

  const WorkTree& tree_;
  std::vector<std::vector<Region>> runs_, iterations_;  // by node, one for each buffer

  std::vector<Region> regions(const std::vector<const Group*>& groups, size_t first_place) const;
  Region region_of(const Group& group, size_t first_place) const;
};

}  // namespace retrograde::tuning
