// row_tasks.h -- a long loop of vectors that is the only loop of its stage runs in parallel, in pieces.
//
//   way(i) = sqrt(...)          for i:                  parallel for piece:
//                                 vector of way    =>     for i in the piece:
//                                                           vector of way
//
// Iterations of these loops are independent, so that results do not depend on the pieces.
#pragma once

#include <vector>

#include "autoschedule/size_estimate.h"
#include "graph/function.h"

namespace retrograde::autoschedule {

// Gives parallel loops to those of the Funcs that are at root and have enough work for several threads. All of `funcs`
// have loops from this scheduler. What is computed in their loops stays in the loop of the same name.
void run_rows_in_pieces(const std::vector<FuncPtr>& funcs, const SizeEstimate& sizes);

}  // namespace retrograde::autoschedule
