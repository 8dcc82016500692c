// loop_order.h -- in which order the loops of a sum run, by how what is read lies in memory.
#pragma once

#include <vector>

#include "graph/function.h"

namespace retrograde::autoschedule {

// The reduction variables of an update, innermost first: those that move along rows of what is read
// inside of those that move from row to row or from plane to plane; otherwise as they stand. Only
// where the update may take its terms in any order: others keep theirs.
std::vector<ReductionVariable> reduction_loops(const FuncContents& f, const Definition& update);

// The dimension along which what is read lies next to each other in memory.
size_t innermost_dimension(const Call& call);

// Whether a step along the dimension of the result moves what is read by less than that: some index
// has the dimension and another variable, such as the pixel and the tap of a stencil.
bool shifts_reads(const FuncContents& f, const Definition& update, size_t dimension);

}  // namespace retrograde::autoschedule
