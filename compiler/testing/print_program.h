// A description as the C++ program that it stands for: what a bug report shows.
#pragma once

#include <string>

#include "testing/random_schedule.h"

namespace retrograde::fuzz {

// "a, b, c"
std::string join(const std::vector<std::string>& parts);

// The definitions, the schedule, and the realization of every output.
std::string to_cpp(const PipelineSpec& pipeline, const ScheduleSpec& schedule);
// The schedule alone.
std::string to_cpp(const ScheduleSpec& schedule);

}  // namespace retrograde::fuzz
