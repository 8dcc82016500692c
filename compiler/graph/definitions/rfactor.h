// rfactor.h -- Stage::rfactor: computes the partial results of an update in a Func of its own.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "graph/directives/give_directive.h"

namespace retrograde::graph {

// Returns the new Func. It reduces over the loops that are not preserved, separately for each value
// of the preserved ones, which become pure variables under the given names. `wanted` is its name,
// made unique; when empty, that of the Func with _intm.
FuncPtr factor_out(const SchedulePlace& place,
                   const std::vector<std::pair<NamedLoop, std::string>>& preserved,
                   const std::string& wanted = "");

}  // namespace retrograde::graph
