#include "driver/plan_search.h"

#include <algorithm>
#include <unordered_set>

#include "autoschedule/machine/kept_machine.h"
#include "graph/directives/give_directive.h"
#include "graph/directives/schedule_log.h"
#include "graph/directives/wrappers.h"

namespace retrograde::driver {

using planning::FoundPlan;
using planning::FuncId;
using planning::Plan;

namespace {

// Funcs that no move changes, by number.
std::vector<bool> kept_funcs(const Plan& plan, const std::vector<FuncPtr>& unscheduled,
                             const AutoscheduleOptions& options) {
  std::unordered_set<std::string> of_user;
  for (const FuncPtr& f : topological_order(unscheduled)) {
    if (graph::has_directives(*f)) of_user.insert(f->name);
  }
  for (const auto* named : {&options.store, &options.inlined}) {
    for (const FuncName& f : *named) of_user.insert(f.name);
  }
  const auto makes_func = [](const graph::LoggedDirective& logged) {
    return logged.stage >= 0 && !graph::made_by(logged.directive).empty();
  };
  return ir::mapped(plan.program->funcs, [&](const FuncPtr& f) {
    return of_user.contains(f->name) || std::ranges::any_of(f->log, makes_func);
  });
}

// The moves that make a decision.
std::vector<const char*> moves_of(Decision decision) {
  switch (decision) {
    case Decision::ScatterStrategy:
      return {"scatter_lanes"};
    case Decision::RegisterTiles:
      return {"register_tile"};
    case Decision::LayoutStaging:
      return {"permute_storage"};
    case Decision::JoinSweeps:
      return {"fuse_stages"};
    case Decision::Slices:
    case Decision::Strips:
      return {"compute_at", "compute_in_tile"};
    case Decision::TaskSizes:
      return {"parallelise"};
    case Decision::Choices:
      return {"unroll"};
    case Decision::CutReductions:
      break;
  }
  return {};
}

}  // namespace

std::vector<FuncPtr> PlanSearch::emitted(const FoundPlan& found) const {
  return planning::emit_changes(found.plan, rules);
}

planning::Machine search_machine(const AutoscheduleOptions& options, const Target& target) {
  planning::Machine machine = planning::machine_for(target);
  if (options.threads > 0) machine.threads = options.threads;
  return machine;
}

PlanSearch search_plans(const std::vector<FuncPtr>& scheduled,
                        const std::vector<FuncPtr>& unscheduled, const AutoscheduleOptions& options,
                        const planning::Machine& machine, const PlanSearchOptions& search) {
  const std::vector<FuncPtr> outputs = graph::apply_wrappers(scheduled);
  PlanSearch result{{}, planning::import_plan(outputs)};
  const planning::AccessGraph accesses(outputs);
  const planning::SizeModel sizes(accesses, {planning::unknown_extent});
  planning::Dependences dependences(accesses);
  planning::CostModel cost(accesses, sizes, machine);
  planning::SearchOptions beam;
  beam.width = search.width;
  beam.spare_bytes = static_cast<double>(search.spare_bytes);
  beam.kept = kept_funcs(result.rules, unscheduled, options);
  for (const Decision decision : options.without) {
    for (const char* move : moves_of(decision)) beam.without.insert(move);
  }
  result.result =
      planning::search(result.rules, {accesses, sizes, machine, dependences}, cost, beam);
  return result;
}

}  // namespace retrograde::driver
