// permute_storage -- another dimension is innermost in memory: the one along which the Func itself, or a Func that reads
// it, has lanes.
//
//   copy  root  x, y:16, vector y     =>     copy  root  (y, x)  x, y:16, vector y
//
// Legal: L8. Outputs keep their layout, and so do Funcs that an opaque Func reads.
#include <algorithm>
#include <set>

#include "autoschedule/moves/edit.h"

namespace retrograde::planning::moves {

namespace {

constexpr size_t most_orders = 2;

int16_t lanes_of(const Plan& plan, StageId stage) {
  const std::optional<size_t> depth = vector_loop(plan.nest(stage));
  return depth ? plan.nest(stage).loops[*depth].iterator : once;
}

}  // namespace

std::vector<Plan> permute_storage(const Plan& plan, FuncId func, const Context& context) {
  if (!has_loops(plan, func) || is_output(*plan.program, func)) return {};
  std::set<int> wanted;
  const auto note = [&](const Access& access, int iterator) {
    if (access.of != func || iterator == once) return;
    for (size_t d = 0; d < access.index.size(); ++d) {
      if (access.index[d].moved_by() & set_of(iterator)) wanted.insert(static_cast<int>(d));
    }
  };
  for (const StageNode& stage : context.accesses.func(func).stages)
    note(stage.write, lanes_of(plan, stage.id));
  for (const StageId reader : context.accesses.consumers(func)) {
    if (plan.of(reader.func).opacity != Opacity::None) return {};
    for (const Access& read : context.accesses.stage(reader).reads)
      note(read, lanes_of(plan, reader));
  }
  std::vector<Plan> plans;
  for (const int d : wanted) {
    FuncPlan changed = plan.of(func);
    store_first(changed.storage, d);
    if (plans.size() < most_orders) add(plans, with_func(plan, func, std::move(changed), context));
  }
  return plans;
}

}  // namespace retrograde::planning::moves
