// plan_search.h -- a search over plans that begins with the schedule of the rules, and with no decisions.
//
//   scheduled graph => plan => moves, by predicted time => plan => directives of what changed
#pragma once

#include <set>
#include <string>

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

struct PlanSearchOptions {
  int width = 1;            // of the beam
  int64_t spare_bytes = 0;  // that may be alive at once beyond those of `scheduled`
  autoschedule::Scheduling what = autoschedule::Scheduling::Everything;
  bool from_rules = true;         // searches from their schedule, too, not from nothing alone
  std::set<std::string> without;  // moves that are not made
};

// The machine that the cost of a search is for: that of the cost model, with the threads of the options.
planning::Machine search_machine(const AutoscheduleOptions& options, const Target& target);

// `scheduled`: the graph with the schedule of the rules; `unscheduled`: before. What its user scheduled or named in the
// options stays as it is, and so does the rest of a primal of which they scheduled a part, where gradients are scheduled:
// they leave the rest inline. Decisions that the options leave out forbid the moves that make them.
PlanSearch search_plans(const std::vector<FuncPtr>& scheduled,
                        const std::vector<FuncPtr>& unscheduled, const AutoscheduleOptions& options,
                        const planning::Machine& machine, const PlanSearchOptions& search);

}  // namespace retrograde::driver
