#include "autodiff/sums/kept_values.h"

#include <algorithm>
#include <functional>

#include "autodiff/sums/generated_definitions.h"
#include "autoschedule/cost_estimate.h"
#include "ir/build.h"
#include "ir/visit.h"

namespace retrograde::autodiff {

namespace {

bool is_dear(const Expr& value) {
  const auto of_read = [](const Call&) { return 1.0; };
  return value.type().is_float() &&
         autoschedule::operations_of_values({value}, of_read) > autoschedule::way_to_memory;
}

}  // namespace

LeafAdjoint with_kept_values(const LeafAdjoint& leaf, const FuncPtr& f,
                             const std::vector<Expr>& values) {
  if (!f->is_pure() || std::ranges::none_of(values, is_dear)) return leaf;
  const std::vector<Expr> kept = values_of(f, variables_of(f->args));
  const auto read = [&](const Expr& e, const std::function<Expr(const Expr&)>& recurse) {
    for (size_t k = 0; k < values.size(); ++k) {
      if (e.same_as(values[k]) && is_dear(e)) return kept[k];
    }
    return map_children(e, recurse);
  };
  return {leaf.leaf, rewrite(leaf.adjoint, read)};
}

}  // namespace retrograde::autodiff
