// lane_dimension.h -- Funcs whose first dimension is shorter than a vector, such as the taps of a filter
// for each column: vectors, and memory, run along a longer one.
//
//   weights(k, x) = ...;   out(x, y) = weights(0, x) * in(x, y) + weights(1, x) * in(x + 1, y)
//
// Along k most lanes of a vector are beyond the end, and a vector of out takes its weights from as many
// lines of the cache.
#pragma once

#include <unordered_map>
#include <vector>

#include "autoschedule/size_estimate.h"
#include "graph/function.h"

namespace retrograde::autoschedule {

class LaneDimensions {
 public:
  // `stored`: Funcs without directives that will be at root. Those that are asked for are pure, none
  // of the outputs, whose memory is their user's, and no adjoints.
  LaneDimensions(const std::vector<FuncPtr>& outputs, const std::vector<FuncPtr>& stored, int lanes,
                 const SizeEstimate& sizes);
  // Mostly the first.
  size_t of(const FuncContents& f) const;

 private:
  std::unordered_map<const Symbol*, size_t> others_;
};

}  // namespace retrograde::autoschedule
