// stage_loops.h -- the loops of a stage that has no schedule yet, as one who runs them at once sees them.
//
//   f(x, r.y) += g(x, r.y, r.z)      x: independent, dimension 0; r.y: independent, dimension 1;
//                                    r.z: each iteration adds to the element that the others add to
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "autoschedule/size_estimate.h"
#include "frontend/language/var_or_rvar.h"
#include "graph/function.h"

namespace retrograde::autoschedule {

struct StageLoop {
  VarOrRVar loop;
  std::optional<int64_t> extent;  // nullopt: not known
  bool is_independent = false;    // no two iterations touch one element
  // Of the dimensions whose place it moves the first one in memory; the number of dimensions: none.
  size_t dimension = 0;
};

// Innermost first.
std::vector<StageLoop> loops_of_stage(const FuncContents& f, int stage, const SizeEstimate& sizes);

}  // namespace retrograde::autoschedule
