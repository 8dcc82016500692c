// cut_scatters.h -- sums at places that data decide, of few elements, in private parts.
//
//   histogram(bin(r.x, r.y)) += 1    =>    parallel for s:
//                                            for r.y, r.x of every 32nd row: parts(bin(r.x, r.y), s) += 1
//                                          for s, i: histogram(i) += parts(i, s)
//
// Iterations that may meet in one element run one after the other. Each part has elements of its
// own, where these are so few that setting them to zero and adding them up is little beside what is
// added to them. The number of parts depends on the program alone, and so does every bit.
#pragma once

#include <unordered_set>
#include <vector>

#include "autoschedule/size_estimate.h"
#include "graph/function.h"

namespace retrograde::autoschedule {

// Factors such updates of Funcs of this graph that nobody scheduled and no differentiation made,
// which has cut its own. `but`: not of these.
void cut_scatters(const std::vector<FuncPtr>& outputs, const SizeEstimate& sizes,
                  const std::unordered_set<const Symbol*>& but = {});

}  // namespace retrograde::autoschedule
