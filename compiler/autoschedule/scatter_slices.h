// scatter_slices.h -- a large scatter that one Func reads is computed slice by slice, in its loops.
//
//   for y, x, c: sum = 0                                  parallel for c by 4:
//   for c by 16: for r: sum(i(r), j(r), c) += ...           for y, x: sum = 0
//   for c, y, x: adjoint = float(sum)             =>        for r: sum(i(r), j(r), 4 of c) += ...
//                                                           for y, x: adjoint = float(sum)
//
// c is the dimension of its lanes (scatter_schedule.h): places are the same for all of it, so that a
// slice is computed for itself. Instead of the whole sum, in double, there is a slice for each
// thread, as narrow as lanes are worth it.
#pragma once

#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "autoschedule/scatter_schedule.h"
#include "autoschedule/size_estimate.h"
#include "graph/function.h"

namespace retrograde::autoschedule {

struct ScatterSlices {
  FuncPtr scatter, reader;
  ScatterLanes lanes;              // of the scatter
  size_t dimension = 0;            // of the reader: that of the lanes
  std::vector<size_t> apart = {};  // of the reader: each value has places of its own
};

// By the scatter, and by the reader. Of the stored Funcs that nobody scheduled; `but`: none of these.
class SlicedScatters {
 public:
  SlicedScatters(const std::vector<FuncPtr>& outputs, const std::vector<FuncPtr>& stored,
                 const std::unordered_set<const Symbol*>& but, const SizeEstimate& sizes);
  const ScatterSlices* of_scatter(const FuncContents& f) const { return find(by_scatter_, f); }
  const ScatterSlices* of_reader(const FuncContents& f) const { return find(by_reader_, f); }

 private:
  using Index = std::unordered_map<const Symbol*, size_t>;
  const ScatterSlices* find(const Index& index, const FuncContents& f) const {
    const auto found = index.find(&f);
    return found == index.end() ? nullptr : &all_[found->second];
  }
  std::vector<ScatterSlices> all_;
  Index by_scatter_, by_reader_;
};

// The loops of the reader, in which the scatter, which has its own (schedule_scatter_lanes), is
// computed from now on.
void schedule_slices(const ScatterSlices& slices);

}  // namespace retrograde::autoschedule
