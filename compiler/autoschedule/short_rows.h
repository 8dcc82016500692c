// short_rows.h -- stages whose first dimension is much shorter than a vector: vectors run along a longer one.
//
//   residual(j, i) = select(j == 0, u(i), v(i)) - observed(j, i)        j: 0 to 1
//
//   for i:                        for i by 16:
//     for j in vectors:     =>      for j, unrolled:
//       residual = ...                for i in vectors: residual = ...
//
// Along j, 14 of 16 lanes lie beyond the end, and each row computes everything again. Along i all lanes are used, and
// the copies share what does not depend on j. Memory is then accessed with strides, so the stage must compute enough
// for each element.
#pragma once

#include "autoschedule/size_estimate.h"
#include "frontend/schedule/stage.h"
#include "graph/function.h"

namespace retrograde::autoschedule {

// Gives the stage its loops, with vectors of `lanes`. Returns false if rows are not short, or the stage reduces.
bool schedule_short_rows(const FuncContents& f, int index, Stage& stage, int lanes,
                         const SizeEstimate& sizes);

}  // namespace retrograde::autoschedule
