// scatter_lanes -- a scatter runs in vectors along a dimension that its places don't depend on. This dimension is innermost
// in memory, so lanes lie together and never meet.
//
//   sum  root                                      sum  root  (c, x, y)
//     .1  c, r.y, r.x                     =>         .0  y, x, c:4, vector c
//                                                    .1  c:4, r.y, r.x, vector c
//
// Legal: L4, L6: iterations of a pure variable write different elements; L2: the loops of the reduction keep their order.
// Outputs keep their layout.
#include <algorithm>

#include "autoschedule/moves/edit.h"

namespace retrograde::planning::moves {

namespace {

constexpr size_t most_dimensions = 2;

// Whether the reduction decides where the stage writes.
bool scatters(const Context& context, const StageNode& stage) {
  const auto count = static_cast<int>(stage.iterators.size());
  for (int i = 0; i < count; ++i) {
    if (is_reduction(context, stage.id, i) && (stage.write.moved_by() & set_of(i))) return true;
  }
  return false;
}

bool is_pure_in_all_stages(const Context& context, FuncId func, int dimension) {
  const std::vector<StageNode>& stages = context.accesses.func(func).stages;
  return std::ranges::all_of(stages, [&](const StageNode& stage) {
    return std::ranges::find(stage.iterators, dimension, &Iterator::dimension) !=
           stage.iterators.end();
  });
}

}  // namespace

std::vector<Plan> scatter_lanes(const Plan& plan, FuncId func, const Context& context) {
  const std::vector<StageNode>& stages = context.accesses.func(func).stages;
  const bool may_change = has_loops(plan, func) && !is_output(*plan.program, func) &&
                          has_bounded_region(plan, context, func);
  std::vector<Plan> plans;
  if (!may_change || std::ranges::none_of(
                         stages, [&](const StageNode& stage) { return scatters(context, stage); }))
    return plans;
  const Cover extents = loop_extents(plan, context, {func, 0});
  for (size_t d = 0; d < extents.size() && plans.size() < most_dimensions; ++d) {
    if (!is_pure_in_all_stages(context, func, static_cast<int>(d))) continue;
    FuncPlan changed = plan.of(func);
    store_first(changed.storage, static_cast<int>(d));
    run_along_rows(changed, plan, context, func, extents, 1);
    const auto has_lanes = [](const Nest& nest) { return vector_loop(nest).has_value(); };
    if (std::ranges::all_of(changed.nests, has_lanes))
      add(plans, with_func(plan, func, std::move(changed), context));
  }
  return plans;
}

}  // namespace retrograde::planning::moves
