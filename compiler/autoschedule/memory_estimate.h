// memory_estimate.h -- how many bytes of what a scheduled graph computes on the way are alive at once.
//
//   a = ..., b = ...a..., c = ...b..., out = ...c... + a     all at root
//
//   computing b: a, b      c: a, b, c      out: a, c         the most: a, b and c
//
// A Func at root lives from where it is computed, in the order of lowering (graph/computing_order.h),
// to the last loop nest that reads it, as lowering frees it. What is computed in the loops of another Func lives as long as
// these, a slice for each thread. Inputs and outputs are the caller's.
#pragma once

#include <cstdint>
#include <vector>

#include "autoschedule/size_estimate.h"
#include "graph/function.h"

namespace retrograde::autoschedule {

struct MemoryEstimate {
  struct Part {
    FuncPtr func;
    int64_t bytes;
  };
  int64_t peak_bytes = 0;
  std::vector<Part> at_peak;  // the largest first
};

// Sizes that are not known count as nothing.
MemoryEstimate estimate_memory(const std::vector<FuncPtr>& outputs, const SizeEstimate& sizes,
                               int64_t threads);

}  // namespace retrograde::autoschedule
