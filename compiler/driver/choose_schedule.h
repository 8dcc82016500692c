// choose_schedule.h -- the schedule of the rules or, where the options ask for it, the best plan that a search finds.
//
//   options            what is taken
//   (none)             what the rules choose (autoschedule/default_schedule.h, memory_budget.h)
//   search=true        the plan of the least cost to which moves lead, from the rules' plan or from none (plan_search.h);
//                      the schedule of the rules where nothing is clearly better, or where sizes are not known
//
// A prediction is right within some percent at best, so that a gain of less is none. Two models must agree: the cost of
// plans, and the prediction of the lowered program.
#pragma once

#include <string>
#include <vector>

#include "autoschedule/memory_budget.h"
#include "frontend/run/schedule_report.h"

namespace retrograde::driver {

struct ChosenSchedule {
  autoschedule::ScheduledGraph graph;
  SearchedSchedules search;
};

// `outputs`: of a graph whose wrappers have been applied, which stays as it is. `wants_runner_up`: searches without being
// asked to take what it finds, too.
ChosenSchedule choose_schedule(const std::vector<FuncPtr>& outputs,
                               const autoschedule::ScheduleRequest& request,
                               autoschedule::Scheduling what, const Target& target,
                               bool wants_runner_up = false);

// Why a search that was asked for did not run, as SearchedSchedules::note tells it.
std::string note_against_search(const std::vector<FuncPtr>& outputs, const std::string& rule,
                                const std::string& evidence, const std::string& instead);

}  // namespace retrograde::driver
