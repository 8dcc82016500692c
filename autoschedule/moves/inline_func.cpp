// inline_func -- a Func without updates is computed wherever it is read.
//
//   blur  root  ...     =>     blur  inline
//
// Legal: L5, L8. Outputs and Funcs that an opaque Func reads stay in memory.
#include "autoschedule/moves/edit.h"
#include "autoschedule/plan/nest.h"

namespace retrograde::planning::moves {

namespace {

int64_t body_size(const Plan& plan, const Context& context, StageId stage) {
  return body_operations(plan, context, stage, plan.nest(stage),
                         loop_extents(plan, context, stage));
}

}  // namespace

std::vector<Plan> inline_func(const Plan& plan, FuncId func, const Context& context) {
  const graph::FuncContents& f = *plan.program->funcs[static_cast<size_t>(func)];
  if (!is_editable(plan, func, context) || f.stage_count() > 1 || is_output(*plan.program, func))
    return {};
  FuncPlan inlined;
  inlined.placement.compute.kind = Level::Kind::Inline;
  inlined.nests = {loops_of_definition(f, 0)};
  for (int d = 0; d < f.dimensions(); ++d) inlined.storage.order.push_back(static_cast<int16_t>(d));
  const std::optional<Plan> result = with_func(plan, func, std::move(inlined), context);
  if (!result) return {};
  for (const StageId reader : all_readers(*result, context, func)) {
    if (result->of(reader.func).opacity != Opacity::None) return {};
    if (is_inlined(*result, reader.func)) continue;
    if (is_kernel(result->nest(reader)) && !may_be_kernel(*result, context, reader)) return {};
    const int64_t before = body_size(plan, context, reader);
    const int64_t size = body_size(*result, context, reader);
    if (size > before && size > most_body_operations) return {};
  }
  return {*result};
}

}  // namespace retrograde::planning::moves
