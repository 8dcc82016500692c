// inline_func -- a Func without updates is computed wherever it is read.
//
//   blur  root  ...     =>     blur  inline
//
// Legal: L5, L8. Outputs and Funcs that an opaque Func reads stay in memory.
#include "autoschedule/moves/edit.h"
#include "autoschedule/plan/nest.h"

namespace retrograde::planning::moves {

std::vector<Plan> inline_func(const Plan& plan, FuncId func, const Context& context) {
  const graph::FuncContents& f = *plan.program->funcs[static_cast<size_t>(func)];
  if (!is_editable(plan, func) || f.stage_count() > 1 || is_output(*plan.program, func)) return {};
  FuncPlan inlined;
  inlined.placement.compute.kind = Level::Kind::Inline;
  inlined.nests = {loops_of_definition(f, 0)};
  for (int d = 0; d < f.dimensions(); ++d) inlined.storage.order.push_back(static_cast<int16_t>(d));
  const std::optional<Plan> result = with_func(plan, func, std::move(inlined), context);
  if (!result) return {};
  for (size_t id = 0; id < result->funcs.size(); ++id) {
    const FuncPlan& reader = *result->funcs[id];
    const std::vector<StageNode>& stages = context.accesses.func(static_cast<FuncId>(id)).stages;
    for (const StageNode& stage : stages) {
      bool reads = false;
      for (const Access& read : stage.reads) reads = reads || read.of == func;
      if (reads && reader.opacity != Opacity::None) return {};
      if (reader.opacity != Opacity::None || reader.placement.compute.kind == Level::Kind::Inline)
        continue;
      const int64_t size = operations(*result, context, stage.id) *
                           copies(result->nest(stage.id), context, stage.id);
      const int64_t before =
          operations(plan, context, stage.id) * copies(plan.nest(stage.id), context, stage.id);
      if (size > before && size > most_body_operations) return {};
    }
  }
  return {*result};
}

}  // namespace retrograde::planning::moves
