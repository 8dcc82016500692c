// placement_limits.h -- the Funcs that data-dependent indices, extern stages or a user's schedule keep in place.
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
