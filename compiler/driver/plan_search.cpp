#include "driver/plan_search.h"

#include <algorithm>
#include <unordered_set>

#include "graph/directives/give_directive.h"
#include "graph/directives/schedule_log.h"
#include "graph/directives/wrappers.h"

namespace retrograde::driver {

using planning::FoundPlan;
using planning::FuncId;
using planning::Plan;

namespace {

// Funcs that no move changes, by number.
std::vector<bool> kept_funcs(const Plan& plan, const std::vector<FuncPtr>& unscheduled) {
  std::unordered_set<std::string> of_user;
  for (const FuncPtr& f : topological_order(unscheduled)) {
    if (graph::has_directives(*f)) of_user.insert(f->name);
  }
  const auto makes_func = [](const graph::LoggedDirective& logged) {
    return logged.stage >= 0 && !graph::made_by(logged.directive).empty();
  };
  return ir::mapped(plan.program->funcs, [&](const FuncPtr& f) {
    return of_user.contains(f->name) || std::ranges::any_of(f->log, makes_func);
  });
}

}  // namespace

std::vector<FuncPtr> PlanSearch::emitted(const FoundPlan& found) const {
  return planning::emit_changes(found.plan, rules);
}

PlanSearch search_plans(const std::vector<FuncPtr>& scheduled,
                        const std::vector<FuncPtr>& unscheduled, const planning::Machine& machine,
                        int64_t spare_bytes, int width) {
  const std::vector<FuncPtr> outputs = graph::apply_wrappers(scheduled);
  PlanSearch search{{}, planning::import_plan(outputs)};
  const planning::AccessGraph accesses(outputs);
  const planning::SizeModel sizes(accesses, {planning::unknown_extent});
  planning::Dependences dependences(accesses);
  planning::CostModel cost(accesses, sizes, machine);
  planning::SearchOptions options;
  options.width = width;
  options.spare_bytes = static_cast<double>(spare_bytes);
  options.kept = kept_funcs(search.rules, unscheduled);
  search.result =
      planning::search(search.rules, {accesses, sizes, machine, dependences}, cost, options);
  return search;
}

}  // namespace retrograde::driver
