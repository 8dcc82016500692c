// permute_storage -- another dimension is innermost in memory: the one along which the Func itself, or a Func that reads
// it, has lanes. Or what the Func reads is stored along its lanes.
//
//   copy  root  x, y:16, vector y     =>     copy  root  (y, x)  x, y:16, vector y
//
//   out   root  y:16, x, vector y            out   root  y:16, x, vector y
//   copy  root  y, x                  =>     copy  root  (y, x)  y, x
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

bool may_permute(const Plan& plan, FuncId func, const Context& context) {
  const auto is_opaque = [&](StageId reader) {
    return plan.of(reader.func).opacity != Opacity::None;
  };
  return has_loops(plan, func) && !is_output(*plan.program, func) &&
         std::ranges::none_of(context.accesses.consumers(func), is_opaque);
}

// The plan in which all that the Func reads is stored along its lanes.
std::optional<Plan> with_operands(const Plan& plan, FuncId func, const Context& context) {
  std::optional<Plan> result;
  for (const StageNode& stage : context.accesses.func(func).stages) {
    const int16_t lanes = lanes_of(plan, stage.id);
    for (const Access& read : stage.reads) {
      if (lanes == once || read.of < 0 || read.of == func || !may_permute(plan, read.of, context))
        continue;
      const auto moved = std::ranges::find_if(read.index, [&](const IndexForm& form) {
        return (form.moved_by() & set_of(lanes)) != 0;
      });
      if (moved == read.index.end()) continue;
      const Plan& before = result ? *result : plan;
      FuncPlan operand = before.of(read.of);
      store_first(operand.storage, static_cast<int>(moved - read.index.begin()));
      std::optional<Plan> next = with_func(before, read.of, std::move(operand), context);
      if (next) result = std::move(next);
    }
  }
  return result;
}

}  // namespace

std::vector<Plan> permute_storage(const Plan& plan, FuncId func, const Context& context) {
  std::vector<Plan> plans;
  if (!has_loops(plan, func)) return plans;
  add(plans, with_operands(plan, func, context));
  if (!may_permute(plan, func, context)) return plans;
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
