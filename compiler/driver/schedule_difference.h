// schedule_difference.h -- schedules as texts that are equal for copies of a graph, and where two of them differ.
#pragma once

#include <set>
#include <string>

#include "graph/directives/schedule_log.h"

namespace retrograde::driver {

// The text of a schedule, the same for each copy of a graph. Funcs that a schedule makes have another number in each: all
// names but those known are numbered anew, in their order; the first of a name in the process has no number yet.
std::string with_stable_names(const ScheduleLog& log, const std::set<std::string>& known);

// Directives that only one of them has, a line each: "- " for the first, "+ " for the second.
std::string difference_of(const ScheduleLog& first, const ScheduleLog& second);

}  // namespace retrograde::driver
