// plan_search.h -- a search over plans of a graph, from one in which nothing is decided.
//
//   graph => plan => moves, by predicted time => plans => directives
#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <unordered_set>
#include <vector>

#include "autoschedule/search/search.h"
#include "driver/schedule_request.h"
#include "ir/target.h"

namespace retrograde::driver {

struct PlanSearch {
  planning::SearchResult result;
  planning::Plan given;  // that of the graph, whose user scheduled some Funcs, or none

  // The graph with the directives of a plan that was found.
  std::vector<FuncPtr> emitted(const planning::FoundPlan& found) const;
};

struct PlanSearchOptions {
  // The width of the beam. The best plan is never predicted to be slower than that of a narrower search.
  int width = 1;
  int64_t spare_bytes = 0;  // that may be alive at once
  bool must_fit = false;    // however slow the program gets
  int threads = 0;          // for which parallel loops are chosen; 0: those of the machine
  Scheduling what = Scheduling::Everything;
  std::set<std::string> without = {};         // moves that are not made
  planning::AccessGraph* accesses = nullptr;  // of a program like this one, which is taken
  const planning::Device* device = nullptr;   // that runs the program; null: the processor does
};

// The updates of a device that are atomic.
planning::Atomics atomics_of(const AutoscheduleOptions& options);

// The names of Funcs that no move changes: what its user scheduled, or named to be inlined, and the rest of a primal of
// which they scheduled a part, where gradients are scheduled: they leave the rest inline, unless that computes far more
// (transform/stored_funcs.h).
std::unordered_set<std::string> kept_names(const std::vector<FuncPtr>& unscheduled,
                                           const AutoscheduleOptions& options, Scheduling what);

// `graph`: with its rewrites (autoschedule/rewrites); `unscheduled`: before. Decisions that the options leave out forbid
// the moves that make them.
PlanSearch search_plans(const std::vector<FuncPtr>& graph, const std::vector<FuncPtr>& unscheduled,
                        const AutoscheduleOptions& options, const planning::Machine& machine,
                        const PlanSearchOptions& search);

// The plan in which nothing is decided about these Funcs, and all others stay as they are: the graph with its directives.
std::vector<FuncPtr> stored_along_rows(const std::vector<FuncPtr>& outputs,
                                       const std::vector<FuncPtr>& funcs);

}  // namespace retrograde::driver
