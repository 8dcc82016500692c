#include "plan_sample.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <random>
#include <set>

#include "autoschedule/moves/move.h"
#include "autoschedule/rewrites/rewrites.h"
#include "diagnostics/text_hash.h"
#include "driver/plan_schedule.h"
#include "driver/schedule_difference.h"
#include "graph/directives/schedule_log.h"
#include "graph/directives/wrappers.h"

namespace bench::plans {

using namespace retrograde;
using driver::Scheduling;

namespace {

constexpr double least_share = 0.02;  // of all operations, for a Func to be costly

std::set<std::string> names_of(const std::vector<FuncPtr>& outputs) {
  std::set<std::string> names;
  for (const FuncPtr& f : graph::topological_order(outputs)) names.insert(f->name);
  return names;
}

// Funcs that a schedule makes have other names in each process; the key does not depend on them.
std::string key_of(const planning::Plan& plan, const std::set<std::string>& known) {
  const auto log = graph::schedule_log(planning::emit_plan(plan));
  const uint64_t hash = text_hash(driver::with_stable_names(log, known));
  char key[17];
  std::snprintf(key, sizeof key, "%016llx", static_cast<unsigned long long>(hash));
  return key;
}

SampledPlan imported(const std::string& source, const std::vector<FuncPtr>& scheduled,
                     const std::set<std::string>& known) {
  SampledPlan result{source, "", planning::import_plan(graph::apply_wrappers(scheduled))};
  result.key = key_of(result.plan, known);
  return result;
}

// The default plans without one or two of their decisions.
std::vector<SampledPlan> plans_of_decisions(const std::vector<FuncPtr>& outputs,
                                            const SampleOptions& options, const StandardPlan&) {
  std::vector<SampledPlan> result;
  const std::set<std::string> known = names_of(outputs);
  const auto add = [&](const std::set<Decision>& without) {
    AutoscheduleOptions given;
    given.without = without;
    if (result.size() < options.decisions)
      result.push_back(
          imported("without",
                   driver::schedule_by_plan(outputs, driver::request_for(options.target, given),
                                            Scheduling::Everything)
                       .outputs,
                   known));
  };
  for (const Decision first : all_decisions()) add({first});
  for (const Decision first : all_decisions()) {
    for (const Decision second : all_decisions())
      if (first < second) add({first, second});
  }
  return result;
}

// The Funcs that have a share of the program's operations, without what inlining repeats.
std::vector<planning::FuncId> costly_funcs(const planning::AccessGraph& accesses,
                                           const planning::SizeModel& sizes) {
  std::vector<double> work(accesses.funcs().size(), 0);
  for (const planning::FuncNode& func : accesses.funcs()) {
    for (const planning::StageNode& stage : func.stages) {
      double operations = 1;
      for (const planning::OperationCount& each : stage.operations) operations += each.count;
      for (size_t i = 0; i < stage.iterators.size(); ++i)
        operations *= static_cast<double>(sizes.of(stage.id, static_cast<int>(i)).estimate);
      work[static_cast<size_t>(stage.id.func)] += operations;
    }
  }
  const double least = least_share * std::reduce(work.begin(), work.end());
  std::vector<planning::FuncId> result;
  for (size_t f = 0; f < work.size(); ++f) {
    if (work[f] >= least) result.push_back(static_cast<planning::FuncId>(f));
  }
  return result;
}

// Random moves from the default plan, most of them of costly Funcs. Walks have 1, 2, 4 or 8 steps; a step that has no
// plan is left out.
std::vector<SampledPlan> plans_of_walks(const std::vector<FuncPtr>& outputs,
                                        const SampleOptions& options,
                                        const StandardPlan& standard) {
  const planning::AccessGraph accesses(standard.plan.program->outputs);
  const planning::SizeModel sizes(accesses, {planning::unknown_extent});
  planning::Dependences dependences(accesses);
  const std::set<std::string> known = names_of(outputs);
  const std::vector<planning::FuncId> costly = costly_funcs(accesses, sizes);
  std::mt19937 random(options.seed);
  const auto below = [&](size_t count) { return random() % count; };
  std::vector<SampledPlan> result;
  for (size_t walk = 0; walk < options.walks; ++walk) {
    SampledPlan reached{"walk", "", standard.plan};
    for (int step = 1 << walk % 4; step > 0; --step) {
      const planning::FuncId func =
          below(4) > 0 ? costly[below(costly.size())]
                       : static_cast<planning::FuncId>(below(reached.plan.funcs.size()));
      const planning::Move& move = planning::all_moves()[below(planning::all_moves().size())];
      const auto plans =
          move.apply(reached.plan, func, {accesses, sizes, options.machine, dependences});
      if (plans.empty()) continue;
      reached.plan = plans[below(plans.size())];
      reached.source += std::string(" ") + move.name;
    }
    reached.key = key_of(reached.plan, known);
    result.push_back(std::move(reached));
  }
  return result;
}

// The plans that searches over moves take, from a plan in which nothing is decided.
std::vector<SampledPlan> plans_of_searches(const std::vector<FuncPtr>& outputs,
                                           const SampleOptions& options,
                                           const StandardPlan& standard) {
  const std::set<std::string> known = names_of(outputs);
  std::vector<SampledPlan> result;
  const auto add = [&](const std::string& source, int width, std::set<std::string> without) {
    driver::PlanSearchOptions search;
    search.width = width;
    search.spare_bytes = std::numeric_limits<int64_t>::max();
    search.without = std::move(without);
    const auto found =
        driver::search_plans(standard.rewritten, outputs, {}, options.machine, search);
    const planning::Plan& plan = found.result.found[0].plan;
    result.push_back({source, key_of(plan, known), plan});
  };
  for (const int width : options.widths) add("beam " + std::to_string(width), width, {});
  if (!options.ablation) return result;
  for (const planning::Move& move : planning::all_moves())
    add(std::string("no ") + move.name, 1, {move.name});
  return result;
}

}  // namespace

std::vector<SampledPlan> sample_plans(const std::vector<FuncPtr>& outputs,
                                      const SampleOptions& options) {
  const PlanSource sources[] = {plans_of_searches, plans_of_decisions, plans_of_walks};
  StandardPlan standard;
  standard.rewritten = planning::with_rewrites(outputs);
  driver::PlanSearchOptions search;
  search.spare_bytes = std::numeric_limits<int64_t>::max();
  const auto found = driver::search_plans(standard.rewritten, outputs, {},
                                          planning::reference_machine(options.target), search);
  const planning::Plan& plan = found.result.found[0].plan;
  static_cast<SampledPlan&>(standard) = {"default", key_of(plan, names_of(outputs)), plan};
  std::vector<SampledPlan> result{standard};
  for (const PlanSource& source : sources) {
    for (SampledPlan& plan : source(outputs, options, standard)) {
      const auto known = std::ranges::find(result, plan.key, &SampledPlan::key);
      if (known == result.end())
        result.push_back(std::move(plan));
      else if (plan.source.starts_with("beam") || plan.source.starts_with("no "))
        known->source += ", " + plan.source;
    }
  }
  return result;
}

}  // namespace bench::plans
