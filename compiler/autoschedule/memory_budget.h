// memory_budget.h -- schedules that keep within a budget of memory, as far as sizes are known.
//
//   weight = exp(-distance), stored: 480 MB          distance: 480 MB
//   distance: 480 MB                            =>   weight: computed where it is read
//
// Where more is alive at once than is allowed, what is alive then and takes the most bytes for each
// operation that would be done again is computed where it is read; and so on, until it fits.
// Not done: parts of iterations in time computed again from kept states; clones for far readers.
#pragma once

#include <cstdint>
#include <vector>

#include "autoschedule/default_schedule.h"
#include "graph/function.h"

namespace retrograde::autoschedule {

// Of a call, at the most: inputs and outputs, too.
struct MemoryUse {
  int64_t bytes = 0, budget_bytes = 0;
};
struct ScheduledGraph {
  std::vector<FuncPtr> outputs;  // of a copy of the graph
  MemoryUse memory;
};

// `outputs`: of a graph whose wrappers have been applied.
ScheduledGraph schedule_within_budget(const std::vector<FuncPtr>& outputs,
                                      const ScheduleRequest& request, Scheduling what);

}  // namespace retrograde::autoschedule
