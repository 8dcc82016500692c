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

namespace retrograde::transform {

// The ends that are constants.
Interval constant_ends(const Interval& i);

class SizeEstimate {
 public:
  SizeEstimate() = default;  // nothing is known
  explicit SizeEstimate(const std::vector<FuncPtr>& outputs);
  // Elements of a dimension that are computed; nullopt: not known.
  std::optional<int64_t> extent(const FuncContents& f, size_t dimension) const;
  // Between which elements these lie; unbounded: not known.
  Interval range(const FuncContents& f, size_t dimension) const;
  // Bytes of all elements that are computed; 0 where some extent is not known.
  int64_t bytes(const FuncContents& f) const;

 private:
  std::unordered_map<const Symbol*, Box> boxes_;  // with constant ends; undefined: not known
};

}  // namespace retrograde::transform
