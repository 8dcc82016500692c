// hosted_funcs.h -- Funcs in whose loops others are computed or stored, such as the packed rows that register tiles read.
// These move with the loops.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "graph/function.h"

namespace retrograde::transform {

// The names of Funcs that have something computed or stored in their loops.
std::set<std::string> hosts_in(const std::vector<FuncPtr>& outputs);

}  // namespace retrograde::transform
