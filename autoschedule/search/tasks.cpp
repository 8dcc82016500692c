#include "autoschedule/search/tasks.h"

#include <algorithm>

namespace retrograde::planning {

Plan with_tasks(Plan plan, const std::vector<bool>& kept, const Context& context, CostModel& cost) {
  const Move& parallelise = *find_move("parallelise");
  for (size_t f = 0; f < plan.funcs.size(); ++f) {
    if (f < kept.size() && kept[f]) continue;
    std::vector<Plan> plans = parallelise.apply(plan, static_cast<FuncId>(f), context);
    if (plans.empty()) continue;
    plan = *std::ranges::min_element(plans, {},
                                     [&](const Plan& other) { return cost.totals(other).seconds; });
  }
  return plan;
}

}  // namespace retrograde::planning
