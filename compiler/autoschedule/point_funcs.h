// point_funcs.h -- finds Funcs over many points with a few numbers each: vectors, small matrices, colours.
//
//   blended(j, k, i) += weights(r, i) * bones(j, k, r)      j: 0 to 3, k: 0 to 2; i: the points, thousands
//
// 1. The first dimension is known and fills at most half a vector; the first long dimension numbers the points, and
//    those before it have few elements together.
// 2. No stage moves along points or beyond: its coordinates there are the variables of the Func. Before, they are
//    variables or constants.
// 3. Vectors along points take less time than vectors along the first dimension.
//
// Model: a vector along the first dimension computes the elements of one point; a vector along points computes one element of
// each. The latter loads what its elements share once. A load or store with a stride takes a few shuffles if the stride is
// small and known, and one access for each lane otherwise.
//
// Not done: long float32 sums, which are added in blocks (long_sums.h); private parts; scatters.
#pragma once

#include <optional>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "autoschedule/size_estimate.h"
#include "graph/function.h"

namespace retrograde::autoschedule {

class PointFuncs {
 public:
  // Among Funcs without directives that will be at root. `excluded`: none of these.
  PointFuncs(const std::vector<FuncPtr>& outputs, const std::vector<FuncPtr>& stored,
             const std::unordered_set<const Symbol*>& excluded, int lanes,
             const SizeEstimate& sizes);

  // The dimension that numbers the points; nullopt: it is no such Func.
  std::optional<size_t> points_of(const FuncContents& f) const;
  // Whether consumers read it along points, so that these lie next to each other in memory.
  bool is_stored_along_points(const FuncContents& f) const { return turned_.contains(&f); }

 private:
  std::unordered_map<const Symbol*, size_t> points_;
  std::unordered_set<const Symbol*> turned_;
};

}  // namespace retrograde::autoschedule
