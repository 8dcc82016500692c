// root -- a Func is computed before all Funcs that read it, along rows in parallel.
//
//   blur  at out/y  y, x     =>     blur  root  parallel y, x:16, vector x
//
// Legal: L3, L8. A Func that is computed in a loop is dropped with the plan if this Func reads it from outside then (P2).
#include "autoschedule/moves/edit.h"

namespace retrograde::planning::moves {

std::vector<Plan> root(const Plan& plan, FuncId func, const Context& context) {
  if (!is_editable(plan, func, context) ||
      plan.of(func).placement.compute.kind == Level::Kind::Root ||
      !has_bounded_region(plan, context, func))
    return {};
  FuncPlan changed = plan.of(func);
  changed.placement = {};
  changed.placement.compute.kind = Level::Kind::Root;
  changed.storage.folds.clear();
  run_along_rows(changed, plan, context, func, whole_cover({func, 0}, context.sizes), 1);
  std::vector<Plan> plans;
  add(plans, with_func(plan, func, std::move(changed), context));
  return plans;
}

}  // namespace retrograde::planning::moves
