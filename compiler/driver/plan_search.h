// plan_search.h -- a search over plans that begins with the schedule of the rules, and with no decisions.
//
//   scheduled graph => plan => moves, by predicted time => plan => directives of what changed
#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <unordered_set>
#include <vector>

#include "autoschedule/default_schedule.h"
#include "autoschedule/search/search.h"
#include "frontend/schedule/autoschedule_options.h"
#include "ir/target.h"

namespace retrograde::driver {

struct PlanSearch {
  planning::SearchResult result;
  planning::Plan rules;  // where it began

  // The graph with the directives of a plan that was found.
  std::vector<FuncPtr> emitted(const planning::FoundPlan& found) const;
};

// Where a search begins.
enum class SearchStart : uint8_t {
  Nothing,             // a plan in which nothing is decided; the graph has rewrites alone
  NothingBesideRules,  // the same; the graph has the schedule of the rules, which is priced
  Both,                // that schedule, too
};

struct PlanSearchOptions {
  SearchStart start = SearchStart::Both;
  int width = 1;  // of the beam
  // That may be alive at once; beyond those of `scheduled`, if it has the schedule of the rules.
  int64_t spare_bytes = 0;
  bool must_fit = false;  // without rules: however slow the program gets
  autoschedule::Scheduling what = autoschedule::Scheduling::Everything;
  std::set<std::string> without;              // moves that are not made
  planning::AccessGraph* accesses = nullptr;  // of a program like this one, which is taken
  const planning::Device* device = nullptr;   // that runs the program; null: the processor does
};

// The machine that the cost of a search is for: that of the cost model, with the threads of the options.
planning::Machine search_machine(const AutoscheduleOptions& options, const Target& target);

// The updates of a device that are atomic.
planning::Atomics atomics_of(const AutoscheduleOptions& options);

// The names of Funcs that no move changes: what its user scheduled, or named to be inlined.
std::unordered_set<std::string> kept_names(const std::vector<FuncPtr>& unscheduled,
                                           const AutoscheduleOptions& options,
                                           autoschedule::Scheduling what);

// `scheduled`: the graph with the schedule of the rules, or with rewrites alone; `unscheduled`: before. What its user
// scheduled or named in the options stays as it is, and so does the rest of a primal of which they scheduled a part, where
// gradients are scheduled: they leave the rest inline. Decisions that the options leave out forbid the moves that make them.
PlanSearch search_plans(const std::vector<FuncPtr>& scheduled,
                        const std::vector<FuncPtr>& unscheduled, const AutoscheduleOptions& options,
                        const planning::Machine& machine, const PlanSearchOptions& search);

}  // namespace retrograde::driver
