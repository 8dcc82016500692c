// size_estimate.h -- how far the dimensions of Funcs reach, as far as that is known: from bounds and
// estimates of the outputs, sizes of images and estimates of parameters, through what each Func
// reads of the others.
#pragma once

#include <cstdint>
#include <optional>
#include <unordered_map>
#include <vector>

#include "analysis/interval.h"
#include "graph/function.h"

namespace retrograde::autoschedule {

// What sizes are weighed against.
struct MachineLimits {
  // Iterations of loops that run in parallel: no thread of a few waits long for the others.
  int64_t enough_tasks = 8;
  // More bytes than stay in the caches near a core.
  int64_t more_than_caches = 16 << 20;
  // Less stays in the caches on its way from one loop to the next.
  int64_t passes_caches = 1 << 20;
  // What one task may hold of what it computes: half of a cache near a core.
  int64_t block_bytes = 384 << 10;
  // Of the rows of a strip, beside those that the rules choose.
  double strip_rows = 1;
};

// The ends that are constants.
Interval constant_ends(const Interval& i);

class SizeEstimate {
 public:
  SizeEstimate() = default;  // nothing is known
  explicit SizeEstimate(const std::vector<FuncPtr>& outputs, const MachineLimits& machine = {});
  // Elements of a dimension that are computed; nullopt: not known.
  std::optional<int64_t> extent(const FuncContents& f, size_t dimension) const;
  // Between which elements these lie; unbounded: not known.
  Interval range(const FuncContents& f, size_t dimension) const;
  // The same, but that so much of one dimension is computed at a time.
  SizeEstimate with_extent(const FuncContents& f, size_t dimension, int64_t extent) const;
  // Of all that is computed; 0 where some extent is not known.
  int64_t bytes(const FuncContents& f) const;
  const MachineLimits& machine() const { return machine_; }

 private:
  MachineLimits machine_;
  std::unordered_map<const Symbol*, Box> boxes_;  // with constant ends; undefined: not known
};

}  // namespace retrograde::autoschedule
