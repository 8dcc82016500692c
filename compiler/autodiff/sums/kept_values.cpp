#include "autodiff/sums/kept_values.h"

#include <algorithm>
#include <functional>

#include "autoschedule/machine/reference.h"
#include "ir/build.h"
#include "ir/visit.h"
#include "transform/cost_estimate.h"

namespace retrograde::autodiff {

namespace {

bool is_dear(const Expr& value) {
  const auto of_read = [](const Call&) { return 1.0; };
  return value.type().is_float() &&
         transform::operations_of_values({value}, of_read) > planning::memory_trip_operations;
}

}  // namespace

LeafAdjoint with_kept_values(const LeafAdjoint& leaf, const std::vector<Expr>& reads,
                             const std::vector<Expr>& values) {
  if (std::ranges::none_of(values, is_dear)) return leaf;
  const auto read = [&](const Expr& e, const std::function<Expr(const Expr&)>& recurse) {
    for (size_t k = 0; k < values.size(); ++k) {
      if (e.same_as(values[k]) && is_dear(e)) return reads[k];
    }
    return map_children(e, recurse);
  };
  return {leaf.leaf, rewrite(leaf.adjoint, read)};
}

}  // namespace retrograde::autodiff
