// Detects the autoscheduler's rules in a schedule, to show that random programs exercise each of them.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "graph/function.h"

namespace retrograde::gradient {

// Descriptions of the rules, detected by the traces that each leaves in directives and loops.
std::set<std::string> rules_seen_in(const std::vector<graph::FuncPtr>& outputs);

}  // namespace retrograde::gradient
