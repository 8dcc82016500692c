// rfactor.h -- Stage::rfactor: the partial results of an update as a Func of its own.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "graph/give_directive.h"

namespace retrograde::graph {

// The new Func, which reduces over the loops that are not named, separately for each value of those
// that are: these become the variables beside them. `wanted`: its name, made unique; empty: that of
// the Func with _intm.
FuncPtr factor_out(const SchedulePlace& place,
                   const std::vector<std::pair<NamedLoop, std::string>>& preserved,
                   const std::string& wanted = "");

}  // namespace retrograde::graph
