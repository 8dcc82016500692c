// Which rules of the autoscheduler a schedule shows, so that one sees that random programs exercise
// each.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "graph/function.h"

namespace retrograde::gradient {

// In words, by the traces that each leaves in directives and loops.
std::set<std::string> rules_seen_in(const std::vector<graph::FuncPtr>& outputs);

}  // namespace retrograde::gradient
