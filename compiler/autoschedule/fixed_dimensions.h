// fixed_dimensions.h -- dimensions that run over the same few values whatever the sizes of the outputs,
// since all that reads them says which: by constants, by clamps, by loops that are fixed themselves.
//
//   bands(x, y, b) = ...;   out(x, y) = bands(x, y, 0) + bands(x, y, 3)      b: 0 to 3
#pragma once

#include <cstdint>
#include <optional>
#include <unordered_map>
#include <vector>

#include "analysis/interval.h"
#include "graph/function.h"

namespace retrograde::autoschedule {

struct FixedRange {
  int64_t min, extent;
};

// Proven, not estimated: such a dimension can be given as a bound.
class FixedDimensions {
 public:
  explicit FixedDimensions(const std::vector<FuncPtr>& outputs);
  std::optional<FixedRange> of(const FuncContents& f, size_t dimension) const;

 private:
  void note_reads(const FuncPtr& f);

  std::unordered_map<const Symbol*, Box> boxes_;  // constant ends, or none
};

}  // namespace retrograde::autoschedule
