// task_sizes.h -- which loops run in parallel, for so many threads.
//
//   1 thread:            for y: for x          none
//   without TaskSizes:   parallel y: for x     the outermost of those that do
//   else:                parallel y, x         as many as make enough tasks
#pragma once

#include <unordered_set>
#include <vector>

#include "autoschedule/default_schedule.h"
#include "autoschedule/size_estimate.h"
#include "graph/function.h"

namespace retrograde::autoschedule {

// 0: not said.
int threads_of(const ScheduleRequest& request);

class TaskSizes {
 public:
  // Before anything is scheduled: what a user has scheduled stays.
  explicit TaskSizes(const std::vector<FuncPtr>& order);
  // Takes back what is too much of the schedule; sums that were cut have new Funcs.
  void limit(const std::vector<FuncPtr>& outputs, const ScheduleRequest& request) const;

 private:
  std::unordered_set<const Symbol*> touched_;
};

}  // namespace retrograde::autoschedule
