// choose_schedule.h -- the schedule of the rules or, where the options ask for it, the best one that a
// search over what they decide finds by predicted time.
//
//   options            what is taken
//   (none)             what the rules choose (default_schedule.h, memory_budget.h)
//   search=true        the least predicted time of some dozen schedules (schedule_search.h); that of
//                      the rules where nothing is clearly better, or where sizes are not known
//
// It never fails where the rules do not: a schedule that cannot be lowered is left out. What a model
// predicts is right within some percent at best, so that a gain of less is none.
#pragma once

#include <string>
#include <vector>

#include "autoschedule/memory_budget.h"
#include "autoschedule/schedule_search.h"
#include "frontend/run/schedule_report.h"

namespace retrograde::autoschedule {

struct ChosenSchedule {
  ScheduledGraph graph;
  SearchedSchedules search;
};

// `outputs`: of a graph whose wrappers have been applied, which stays as it is. `cost`: for a search.
// `wants_runner_up`: searches without being asked to take what it finds, too.
ChosenSchedule choose_schedule(const std::vector<FuncPtr>& outputs, const ScheduleRequest& request,
                               Scheduling what, const ScheduleCost& cost,
                               bool wants_runner_up = false);

// Why a search that was asked for did not run, as SearchedSchedules::note tells it.
std::string note_against_search(const std::vector<FuncPtr>& outputs, const std::string& rule,
                                const std::string& evidence, const std::string& instead);

}  // namespace retrograde::autoschedule
