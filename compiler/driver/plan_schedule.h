// plan_schedule.h -- schedules that a search over plans finds.
//
//   graph => partial sums and copies as Funcs => plan of nothing => moves, by predicted time => plan => directives
//
// The figures of the machine are those of the target. Its threads are the reference threads, unless the options say how
// many there are: no processor decides any bit.
#pragma once

#include <vector>

#include "driver/plan_search.h"
#include "driver/schedule_request.h"

namespace retrograde::driver {

// The schedules that a search found for a copy of a graph, the best first.
class PlannedSchedules {
 public:
  // Schedules the Funcs of the graph, whose wrappers have been applied, as far as their user did not. Bytes that are not
  // known count as 0. `width`: of the beam.
  PlannedSchedules(const std::vector<FuncPtr>& outputs, const ScheduleRequest& request,
                   Scheduling what, int width = 1);

  const planning::SearchResult& result() const { return search_.result; }
  // Errors where directives cannot say what a plan does.
  ScheduledGraph scheduled(const planning::FoundPlan& plan) const;
  // The best one without an error.
  ScheduledGraph best() const;

 private:
  PlanSearch search_;
  double callers_bytes_ = 0, budget_bytes_ = 0;
};

// The same for the best schedule of a narrow search.
ScheduledGraph schedule_by_plan(const std::vector<FuncPtr>& outputs, const ScheduleRequest& request,
                                Scheduling what);

}  // namespace retrograde::driver
