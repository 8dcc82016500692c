// vectorise -- lanes along another iterator, or none.
//
//   y, x:16, vector x     =>     y:16, x, vector y      and      y, x
//
// Legal: L1: iterations of pure loops never meet, and those of a reduction are lanes only if they don't; L4: a step of as
// many points as there are lanes stands outside. Lanes of a sum stay: removing them would make its chains of additions longer.
#include <algorithm>

#include "autoschedule/access/lane_form.h"
#include "autoschedule/moves/edit.h"

namespace retrograde::planning::moves {

namespace {

constexpr size_t most_iterators = 3;

// How many accesses have lanes that lie together, or share one element.
int together(const Context& context, StageId stage, int iterator) {
  const StageNode& node = context.accesses.stage(stage);
  int count = 0;
  const auto note = [&](const Access& access, int weight) {
    const LaneForm form =
        lane_form(access, iterator, schedule_lanes, context.sizes, {line_elements});
    if (form.kind == LaneForm::Kind::Contiguous) count += weight;
    if (form.kind == LaneForm::Kind::Strided || form.kind == LaneForm::Kind::Gather)
      count -= weight;
  };
  note(node.write, 2);
  for (const Access& read : node.reads) note(read, 1);
  return count;
}

}  // namespace

std::vector<Plan> vectorise(const Plan& plan, FuncId func, const Context& context) {
  std::vector<Plan> plans;
  if (!has_loops(plan, func)) return plans;
  for (size_t s = 0; s < plan.of(func).nests.size(); ++s) {
    const StageId stage{func, static_cast<int16_t>(s)};
    const std::optional<Nest> plain = without_body(plan.nest(stage), context, stage);
    if (!plain) continue;
    const Cover extents = loop_extents(plan, context, stage);
    std::vector<int> iterators;
    const auto count = static_cast<int>(context.accesses.stage(stage).iterators.size());
    for (int i = 0; i < count; ++i) {
      if (find_loop(*plain, i, 1)) iterators.push_back(i);
    }
    std::ranges::stable_sort(iterators, std::greater(),
                             [&](int i) { return together(context, stage, i); });
    size_t given = 0;
    for (const int i : iterators) {
      if (given == most_iterators) break;
      const auto depth = static_cast<int>(innermost_loop(*plain, i));
      const int64_t points = points_inside(extents, *plain, depth - 1, i);
      const int64_t lanes = lanes_for(plan, stage, points);
      if (lanes == 1) continue;
      Nest nest = *plain;
      run_inside(nest, i, lanes, ForType::Vectorized);
      if (!may_run_at_once(context, stage, nest, nest.loops.size() - 1)) continue;
      ++given;
      add(plans, with_nest(plan, stage, std::move(nest), context));
    }
    add(plans, with_nest(plan, stage, *plain, context));
  }
  return plans;
}

}  // namespace retrograde::planning::moves
