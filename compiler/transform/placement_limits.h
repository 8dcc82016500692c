// placement_limits.h -- what places that data decide, extern stages and the part that a user
// scheduled leave to choose.
#pragma once

#include <unordered_set>
#include <vector>

#include "graph/function.h"

namespace retrograde::transform {

struct PlacementLimits {
  // At root they would be computed over a region without bounds, or would read what is computed
  // inside of another Func's loops.
  std::unordered_set<const Symbol*> stay;
  std::unordered_set<const Symbol*> need_root;  // an extern stage reads them
  // A schedule names a loop of theirs: they need that loop, where it is.
  std::unordered_set<const Symbol*> levels;
};
// The Funcs that are read at places without bounds: data or unclamped arithmetic decide which. `order`: producers before
// consumers.
std::unordered_set<const Symbol*> unbounded_funcs(const std::vector<FuncPtr>& order);
PlacementLimits placement_limits(const std::vector<FuncPtr>& order);

}  // namespace retrograde::transform
