// tasks.h -- the parallel loops of a plan, for another number of threads than it was searched for. No bit depends on them.
#pragma once

#include <vector>

#include "autoschedule/cost/cost.h"
#include "autoschedule/moves/move.h"

namespace retrograde::planning {

// `context` and `cost` are of a machine with the wanted threads. Marked Funcs stay as they are.
Plan with_tasks(Plan plan, const std::vector<bool>& kept, const Context& context, CostModel& cost);

}  // namespace retrograde::planning
