// start.h -- plans that a search begins with.
#pragma once

#include <vector>

#include "autoschedule/moves/move.h"

namespace retrograde::planning {

// Every Func is at root along its rows, or inlined where no stored box suffices: an order of loops that nobody chose, and
// that no search has to leave by a worse plan. `kept`, by Func: runs as in `plan`, and so do Funcs in whose loops it does, and long sums that `plan` adds in lanes, which are
// more exact.
Plan plan_from_nothing(const Plan& plan, const std::vector<bool>& kept, const Context& context);

}  // namespace retrograde::planning
