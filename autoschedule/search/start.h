// start.h -- plans that a search begins with.
#pragma once

#include <vector>

#include "autoschedule/moves/move.h"

namespace retrograde::planning {

// A plan in which each Func is stored at root and runs along its rows; a Func that has no bounded box to store is inlined.
// It takes nothing from `plan`, except the Funcs that run as they do there: those that `kept` marks, by Func; long sums
// that `plan` adds up in lanes, which is more exact than one chain of additions; and Funcs in whose loops one of these runs,
// or that read it there. What these read lies in memory as in `plan`.
Plan plan_from_nothing(const Plan& plan, const std::vector<bool>& kept, const Context& context);

}  // namespace retrograde::planning
