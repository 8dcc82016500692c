#include "driver/plan_search.h"

#include <algorithm>
#include <limits>
#include <unordered_set>
#include <utility>

#include "autoschedule/machine/kept_machine.h"
#include "autoschedule/moves/edit.h"
#include "autoschedule/search/fit_memory.h"
#include "autoschedule/search/start.h"
#include "graph/directives/give_directive.h"
#include "graph/directives/schedule_log.h"
#include "graph/directives/wrappers.h"

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
    case Decision::TaskSizes:
      return {"parallelise"};
    case Decision::Choices:
      return {"unroll"};
    case Decision::CutReductions:
      return {"reduction_lanes"};
  }
  return {};
}

// Whether the Func takes terms in lanes: its bits depend on them.
bool adds_in_lanes(const Plan& plan, FuncId func, const planning::Context& context) {
  for (size_t s = 0; s < plan.of(func).nests.size(); ++s) {
    const planning::StageId stage{func, static_cast<int16_t>(s)};
    const auto adds = [&](const planning::Loop& loop) {
      return loop.kind == ForType::Vectorized && loop.iterator >= 0 &&
             planning::moves::is_reduction(context, stage, loop.iterator);
    };
    if (std::ranges::any_of(plan.nest(stage).loops, adds)) return true;
  }
  return false;
}

// Forbids what changes the order in which elements take their terms in the rules' plan.
void keep_bits(planning::SearchOptions& beam, const Plan& rules, const planning::Context& context) {
  for (size_t f = 0; f < beam.kept.size(); ++f) {
    if (adds_in_lanes(rules, static_cast<FuncId>(f), context)) beam.kept[f] = true;
  }
  for (const planning::Move& move : planning::all_moves()) {
    if (move.changes_bits) beam.without.insert(move.name);
  }
}

bool is_among(const FuncPtr& f, const std::vector<FuncName>& names) {
  return std::ranges::find(names, FuncName(f->name)) != names.end();
}

}  // namespace

std::unordered_set<std::string> kept_names(const std::vector<FuncPtr>& unscheduled,
                                           const AutoscheduleOptions& options,
                                           autoschedule::Scheduling what) {
  std::unordered_set<std::string> kept;
  const std::vector<FuncPtr> order = topological_order(unscheduled);
  const bool by_hand = what == autoschedule::Scheduling::Gradients &&
                       std::ranges::any_of(order, [](const FuncPtr& f) {
                         return !is_adjoint(f) && has_directives(*f);
                       });
  for (const FuncPtr& f : order) {
    if (graph::has_directives(*f) || (by_hand && !is_adjoint(f))) kept.insert(f->name);
  }
  for (const FuncName& f : options.inlined) kept.insert(f.name);
  return kept;
}

std::vector<FuncPtr> PlanSearch::emitted(const FoundPlan& found) const {
  return planning::emit_changes(found.plan, rules);
}

planning::Atomics atomics_of(const AutoscheduleOptions& options) {
  if (options.without.contains(Decision::ScatterStrategy)) return planning::Atomics::None;
  return options.deterministic ? planning::Atomics::OfIntegers : planning::Atomics::OfAll;
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
  planning::CostModel cost(accesses, sizes, machine, search.device);
  const planning::Context context{accesses,    sizes,         machine,
                                  dependences, search.device, atomics_of(options)};
  planning::SearchOptions beam;
  beam.width = search.width;
  beam.most_bytes = static_cast<double>(search.spare_bytes);
  beam.kept = kept_funcs(result.rules, kept_names(unscheduled, options, search.what));
  for (size_t i = 0; i < beam.kept.size(); ++i)
    beam.at_root.push_back(!beam.kept[i] &&
                           is_among(result.rules.program->funcs[i], options.store));
  beam.without = search.without;
  for (const Decision decision : options.without) {
    for (const char* move : moves_of(decision)) beam.without.insert(move);
  }
  if (search.start != SearchStart::Nothing) {
    result.result.start = {result.rules, cost.price(result.rules), {}};
    beam.most_bytes += result.result.start.cost.peak_bytes;
  }
  if (search.start == SearchStart::NothingBesideRules) keep_bits(beam, result.rules, context);
  if (search.start == SearchStart::Both)
    result.result = planning::search(result.rules, context, cost, beam);
  // The other start is known to be slow, so small gains count, too.
  beam.least_gain = least_gain_from_nothing;
  beam.least_gain_of_all = search.device ? 0 : least_gain_of_all_from_nothing;
  const Plan nothing = planning::plan_from_nothing(result.rules, beam.kept, context);
  if (search.start == SearchStart::Nothing) {
    const double most_bytes = std::exchange(beam.most_bytes, planning::SearchOptions().most_bytes);
    result.result = planning::search(nothing, context, cost, beam);
    beam.most_bytes = most_bytes;
    FoundPlan& best = result.result.found.front();
    const double most_seconds = search.must_fit ? std::numeric_limits<double>::infinity()
                                                : worth_fitting * best.cost.seconds;
    best = planning::fit_memory(std::move(best), context, cost, beam, most_seconds);
    return result;
  }
  planning::SearchResult other = planning::search(nothing, context, cost, beam);
  std::erase_if(other.found, [&](const FoundPlan& found) { return found.plan == nothing; });
  planning::merge(result.result, std::move(other));
  return result;
}

}  // namespace retrograde::driver
