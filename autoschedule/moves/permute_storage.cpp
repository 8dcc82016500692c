// permute_storage -- another dimension is innermost in memory: the one along which the Func itself, or a Func that reads
// it, has lanes. Or what the Func reads is stored along its lanes.
//
//   copy  root  x, y:16, vector y     =>     copy  root  (y, x)  x, y:16, vector y
//
//   out   root  y:16, x, vector y            out   root  y:16, x, vector y
//   copy  root  y, x:16, vector x     =>     copy  root  (y, x)  x, y:16, vector y
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
  std::vector<Plan> plans;
  if (!has_loops(plan, func)) return plans;
  for (const StageNode& stage : context.accesses.func(func).stages)
    add(plans, with_turned_operands(plan, stage.id, context));
  const auto is_opaque = [&](StageId reader) {
    return plan.of(reader.func).opacity != Opacity::None;
  };
  if (is_output(*plan.program, func) ||
      std::ranges::any_of(context.accesses.consumers(func), is_opaque))
    return plans;
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
    for (const Access& read : context.accesses.stage(reader).reads)
      note(read, lanes_of(plan, reader));
  }
  size_t orders = 0;
  for (const int d : wanted) {
    FuncPlan changed = plan.of(func);
    store_first(changed.storage, d);
    if (orders++ < most_orders) add(plans, with_func(plan, func, std::move(changed), context));
  }
  return plans;
}

}  // namespace retrograde::planning::moves
