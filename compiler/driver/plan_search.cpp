#include "driver/plan_search.h"

#include <algorithm>
#include <limits>
#include <span>
#include <unordered_set>
#include <utility>

#include "autoschedule/moves/edit.h"
#include "autoschedule/search/fit_memory.h"
#include "autoschedule/search/start.h"
#include "autoschedule/search/tasks.h"
#include "graph/directives/give_directive.h"
#include "graph/directives/schedule_log.h"
#include "graph/directives/wrappers.h"
#include "transform/step_sums.h"
#include "transform/stored_funcs.h"

namespace retrograde::driver {

using planning::FoundPlan;
using planning::FuncId;
using planning::Plan;

namespace {

// The least gain of a change in a search from nothing: a part of the stages that change, and of all.
constexpr double least_gain_from_nothing = 0.02, least_gain_of_all_from_nothing = 0.001;

// How much slower a program may get to keep within a limit of bytes that its user did not give.
constexpr double worth_fitting = 1.25;

bool is_adjoint(const FuncPtr& f) { return f->made.has_value(); }

// By number: the named Funcs, Funcs that keep directives before an rfactor, and the Funcs that it made from their loops.
std::vector<bool> kept_funcs(const Plan& plan, std::unordered_set<std::string> kept) {
  for (const FuncPtr& f : plan.program->funcs) {
    if (graph::can_reset_loops(*f)) continue;
    kept.insert(f->name);
    for (const graph::LoggedDirective& logged : f->log)
      kept.insert(graph::made_by(logged.directive));
  }
  return ir::mapped(plan.program->funcs, [&](const FuncPtr& f) { return kept.contains(f->name); });
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
      return {"fuse_stages", "share_loops", "fuse_readers"};
    case Decision::Slices:
    case Decision::Strips:
      return {"compute_at", "compute_in_tile", "compute_in_reduction", "slide"};
    case Decision::TaskSizes:  // see keep_outermost_tasks
      return {};
    case Decision::Choices:
      return {"unroll"};
    case Decision::CutReductions:
      return {"reduction_lanes"};
  }
  return {};
}

// The plan in which the outermost parallel loop of each stage alone is one.
void keep_outermost_tasks(Plan& plan, const std::vector<bool>& kept) {
  for (size_t f = 0; f < plan.funcs.size(); ++f) {
    if (kept[f]) continue;
    planning::FuncPlan changed = *plan.funcs[f];
    for (planning::Nest& nest : changed.nests) {
      bool is_first = true;
      for (planning::Loop& loop : nest.loops) {
        if (loop.kind != ForType::Parallel) continue;
        if (!std::exchange(is_first, false)) loop.kind = ForType::Serial;
      }
    }
    plan.funcs[f] = std::make_shared<planning::FuncPlan>(std::move(changed));
  }
}

bool is_among(const FuncPtr& f, const std::vector<FuncName>& names) {
  return std::ranges::find(names, FuncName(f->name)) != names.end();
}

}  // namespace

std::unordered_set<std::string> kept_names(const std::vector<FuncPtr>& unscheduled,
                                           const AutoscheduleOptions& options, Scheduling what) {
  std::unordered_set<std::string> kept;
  const std::vector<FuncPtr> order = topological_order(unscheduled);
  const bool by_hand =
      what == Scheduling::Gradients && std::ranges::any_of(order, [](const FuncPtr& f) {
        return !is_adjoint(f) && has_directives(*f);
      });
  for (const FuncPtr& f : order) {
    if (graph::has_directives(*f) || (by_hand && !is_adjoint(f))) kept.insert(f->name);
  }
  if (by_hand) {
    for (const FuncPtr& f : transform::stored_by_default(unscheduled)) {
      if (!graph::has_directives(*f)) kept.erase(f->name);
    }
  }
  for (const FuncName& f : options.inlined) kept.insert(f.name);
  return kept;
}

std::vector<FuncPtr> PlanSearch::emitted(const FoundPlan& found) const {
  return planning::emit_changes(found.plan, given);
}

planning::Atomics atomics_of(const AutoscheduleOptions& options) {
  if (options.without.contains(Decision::ScatterStrategy)) return planning::Atomics::None;
  return options.deterministic ? planning::Atomics::OfIntegers : planning::Atomics::OfAll;
}

namespace {

// All but the width of the beam and the limit of bytes.
planning::SearchOptions limits_of_search(const std::vector<FuncPtr>& outputs, const Plan& given,
                                         const std::vector<FuncPtr>& unscheduled,
                                         const AutoscheduleOptions& options,
                                         const PlanSearchOptions& search) {
  planning::SearchOptions beam;
  beam.kept = kept_funcs(given, kept_names(unscheduled, options, search.what));
  // The cost does not know that lowering keeps a few steps where these are at root.
  const transform::StepSums steps =
      search.device ? transform::StepSums()
                    : transform::step_sums(outputs, transform::SizeEstimate(outputs));
  for (size_t i = 0; i < beam.kept.size(); ++i) {
    const FuncPtr& f = given.program->funcs[i];
    const bool is_sum = steps.sums.contains(f.get());
    const bool has_steps = steps.steps.contains(f.get());
    const bool is_wanted = is_among(f, options.store) || is_sum || (has_steps && !f->is_pure());
    beam.at_root.push_back(!beam.kept[i] && is_wanted);
    beam.in_rows.push_back(!beam.kept[i] && (is_sum || has_steps));
  }
  beam.without = search.without;
  for (const Decision decision : options.without) {
    for (const char* move : moves_of(decision)) beam.without.insert(move);
  }
  // The start is known to be slow, so small gains count, too.
  beam.least_gain = least_gain_from_nothing;
  beam.least_gain_of_all = search.device ? 0 : least_gain_of_all_from_nothing;
  return beam;
}

// Plans that were found get the parallel loops that this number of threads wants.
void give_tasks(std::span<FoundPlan> found, int threads, const planning::Context& context,
                const std::vector<bool>& kept) {
  planning::Machine machine = context.machine;
  machine.threads = threads;
  const planning::Context threaded{context.accesses,    context.sizes,  machine,
                                   context.dependences, context.device, context.atomics};
  planning::CostModel cost(context.accesses, context.sizes, machine, context.device);
  for (FoundPlan& each : found)
    each.plan = planning::with_tasks(std::move(each.plan), kept, threaded, cost);
}

}  // namespace

PlanSearch search_plans(const std::vector<FuncPtr>& graph, const std::vector<FuncPtr>& unscheduled,
                        const AutoscheduleOptions& options, const planning::Machine& machine,
                        const PlanSearchOptions& search) {
  const std::vector<FuncPtr> outputs = graph::apply_wrappers(graph);
  PlanSearch result{{}, planning::import_plan(outputs)};
  const Plan& given = result.given;
  planning::AccessGraph known;
  if (search.accesses) known = std::move(*search.accesses);
  const planning::AccessGraph accesses(outputs, std::move(known));
  const planning::SizeModel sizes(accesses, {planning::unknown_extent});
  planning::Dependences dependences(accesses);
  planning::CostModel cost(accesses, sizes, machine, search.device);
  const planning::Context context{accesses,    sizes,         machine,
                                  dependences, search.device, atomics_of(options)};
  planning::SearchOptions beam = limits_of_search(outputs, given, unscheduled, options, search);
  const Plan nothing = planning::plan_from_nothing(given, beam.kept, context);
  result.result = planning::search(nothing, context, cost, beam);
  if (search.width > 1) {
    beam.width = search.width;
    planning::merge(result.result, planning::search(nothing, context, cost, beam));
  }
  beam.most_bytes = static_cast<double>(search.spare_bytes);
  const auto count = std::min(result.result.found.size(), static_cast<size_t>(search.width));
  const std::span<FoundPlan> best = std::span(result.result.found).first(count);
  for (FoundPlan& found : best) {
    const double most_seconds = search.must_fit ? std::numeric_limits<double>::infinity()
                                                : worth_fitting * found.cost.seconds;
    found = planning::fit_memory(std::move(found), context, cost, beam, most_seconds);
  }
  if (search.threads > 0 && search.threads != machine.threads)
    give_tasks(best, search.threads, context, beam.kept);
  if (options.without.contains(Decision::TaskSizes)) {
    for (FoundPlan& found : best) keep_outermost_tasks(found.plan, beam.kept);
  }
  return result;
}

std::vector<FuncPtr> stored_along_rows(const std::vector<FuncPtr>& outputs,
                                       const std::vector<FuncPtr>& funcs) {
  const Plan given = planning::import_plan(outputs);
  const planning::AccessGraph accesses(outputs);
  const planning::SizeModel sizes(accesses, {planning::unknown_extent});
  planning::Dependences dependences(accesses);
  const planning::Machine machine;
  const planning::Context context{accesses, sizes, machine, dependences};
  const std::vector<bool> kept = ir::mapped(given.program->funcs, [&](const FuncPtr& f) {
    return std::ranges::find(funcs, f) == funcs.end();
  });
  return planning::emit_changes(planning::plan_from_nothing(given, kept, context), given);
}

}  // namespace retrograde::driver
