// A description as the C++ program that it stands for: what a bug report shows.
#pragma once

#include <string>

#include "testing/random_schedule.h"

namespace retrograde::fuzz {

// The definitions, the schedule, and the realization of every output.
std::string to_cpp(const PipelineSpec& pipeline, const ScheduleLog& schedule);

}  // namespace retrograde::fuzz
