// Changes of several Funcs at once: another dimension innermost in memory, and lanes along it, from operands to results.
#include <algorithm>
#include <cstdlib>

#include "autoschedule/moves/edit.h"

namespace retrograde::planning::moves {

namespace {

// The dimension of an access that moves with the iterator, in equal steps; -1: none, or more.
int dimension_along(const Access& access, int iterator) {
  int found = -1;
  for (size_t d = 0; d < access.index.size(); ++d) {
    const IndexForm& form = access.index[d];
    if (!(form.moved_by() & set_of(iterator))) continue;
    if (found >= 0 || form.divisor != 1 || form.modulus != 0 || form.coefficient(iterator) == 0)
      return -1;
    found = static_cast<int>(d);
  }
  return found;
}

bool may_turn(const Plan& plan, const Context& context, FuncId func) {
  return has_loops(plan, func) && !is_output(*plan.program, func) &&
         std::ranges::all_of(context.accesses.consumers(func), [&](StageId reader) {
           return plan.of(reader.func).opacity == Opacity::None;
         });
}

std::optional<Plan> turned(const Plan& plan, FuncId func, int dimension, const Context& context) {
  if (!may_turn(plan, context, func)) return std::nullopt;
  FuncPlan changed = plan.of(func);
  store_first(changed.storage, dimension);
  run_along_rows(changed, plan, context, func, loop_extents(plan, context, {func, 0}), 1);
  return with_func(plan, func, std::move(changed), context);
}

}  // namespace

int64_t lane_stride(const Plan& plan, const Context& context, const Access& read, int iterator) {
  const int dimension = dimension_along(read, iterator);
  if (dimension < 0) return 0;
  const int first = read.of < 0 ? 0 : plan.of(read.of).storage.order[0];
  if (dimension != first && (read.of < 0 || !may_turn(plan, context, read.of))) return 0;
  return std::abs(read.index[static_cast<size_t>(dimension)].coefficient(iterator));
}

std::optional<Plan> with_turned_results(const Plan& plan, FuncId func, int dimension,
                                        const Context& context) {
  std::optional<Plan> result = turned(plan, func, dimension, context);
  if (!result) return result;
  for (const StageId reader : context.accesses.consumers(func)) {
    const StageNode& node = context.accesses.stage(reader);
    for (const Access& read : node.reads) {
      if (read.of != func) continue;
      for (size_t i = 0; i < node.iterators.size(); ++i) {
        const int own = node.iterators[i].dimension;
        if (node.iterators[i].kind != Iterator::Kind::Pure ||
            result->of(reader.func).storage.order[0] == own ||
            dimension_along(read, static_cast<int>(i)) != dimension ||
            read.index[static_cast<size_t>(dimension)].terms.size() > 1)
          continue;
        if (auto next = with_turned_results(*result, reader.func, own, context))
          result = std::move(next);
      }
    }
  }
  return result;
}

std::optional<Plan> with_turned_operands(const Plan& plan, StageId stage, const Context& context) {
  const std::optional<size_t> lanes = vector_loop(plan.nest(stage));
  std::optional<Plan> result;
  if (!lanes) return result;
  const int iterator = plan.nest(stage).loops[*lanes].iterator;
  for (const Access& read : context.accesses.stage(stage).reads) {
    const Plan& before = result ? *result : plan;
    const int dimension = dimension_along(read, iterator);
    if (read.of < 0 || read.of == stage.func || dimension < 0 ||
        before.of(read.of).storage.order[0] == dimension)
      continue;
    if (auto next = turned(before, read.of, dimension, context)) result = std::move(next);
  }
  return result;
}

}  // namespace retrograde::planning::moves
