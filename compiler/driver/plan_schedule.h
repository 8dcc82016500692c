// plan_schedule.h -- a schedule without the rules: the plan that a search finds from one in which nothing is decided.
//
//   graph => partial sums and copies as Funcs => plan of nothing => moves, by predicted time => plan => directives
//
// The figures of the machine are those of the target, and its threads are the reference threads, so that neither the
// processor nor the threads decide any bit.
#pragma once

#include <cstdint>

#include "autoschedule/memory_budget.h"

namespace retrograde::driver {

// Who makes the schedules of processors where no wide search is asked for. Those of GPUs are plans.
enum class DefaultSchedules : uint8_t { OfRules, OfPlans };
inline constexpr auto default_schedules = DefaultSchedules::OfRules;

// Schedules the Funcs of a copy of the graph, whose wrappers have been applied, as far as their user did not. Bytes that are
// not known count as 0. Not done: atomic updates where the bits of results may differ.
autoschedule::ScheduledGraph schedule_by_plan(const std::vector<FuncPtr>& outputs,
                                              const autoschedule::ScheduleRequest& request,
                                              autoschedule::Scheduling what);

}  // namespace retrograde::driver
