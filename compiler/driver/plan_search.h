// plan_search.h -- a search over plans that begins with the schedule of the rules.
//
//   scheduled graph => plan => moves, by predicted time => plan => directives of what changed
#pragma once

#include "autoschedule/search/search.h"

namespace retrograde::driver {

struct PlanSearch {
  planning::SearchResult result;
  planning::Plan rules;  // where it began

  // The graph with the directives of a plan that was found.
  std::vector<FuncPtr> emitted(const planning::FoundPlan& found) const;
};

// `scheduled`: the graph with the schedule of the rules; `unscheduled`: before. What its user scheduled stays as it is, and
// so do Funcs whose directives made others. `spare_bytes`: that may be alive at once beyond those of `scheduled`.
PlanSearch search_plans(const std::vector<FuncPtr>& scheduled,
                        const std::vector<FuncPtr>& unscheduled, const planning::Machine& machine,
                        int64_t spare_bytes, int width);

}  // namespace retrograde::driver
