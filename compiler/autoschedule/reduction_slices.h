// reduction_slices.h -- what a reduction reads slice by slice along its own loops is computed there,
// for strips of the result.
//
//   sums(x, y) += term(x, y, r.x, r.y) + term(x - r.x, y - r.y, r.x, r.y)
//
//   for r.y, r.x, y, x: term = ...           parallel for strips of y:
//   for y, x, r.y, r.x: sums += ...    =>      for r.y, r.x:
//                                                for y, x: term = ...
//                                                for y, x: sums += ...
//
// Of `term` there is a strip of one image for each thread instead of an image for each r. A strip
// computes a few rows more than its own where a slice is read at several. What `term` alone reads slice
// by slice in turn is computed there, too.
#pragma once

#include <unordered_set>
#include <vector>

#include "autoschedule/only_reader.h"
#include "autoschedule/size_estimate.h"
#include "graph/function.h"

namespace retrograde::autoschedule {

// Of the Funcs, all of which this scheduler has given loops, those at root that are larger than
// caches and have one reader, directly or through what is computed inline, which is one of them.
// `but`: none of these, as a reader neither.
void compute_in_reductions(const std::vector<FuncPtr>& outputs, const Readers& readers,
                           const std::vector<FuncPtr>& stored,
                           const std::unordered_set<const Symbol*>& but, const SizeEstimate& sizes);

}  // namespace retrograde::autoschedule
