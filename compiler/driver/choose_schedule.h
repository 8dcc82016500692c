// choose_schedule.h -- the schedule of the rules or, where it is clearly faster, the best plan that a search finds.
//
//   options            what is taken
//   (none)             the plan of the least cost to which a descent over moves leads (plan_search.h). It is the same on
//                      every machine, since figures are those of the target. No move in it reorders the terms of a sum
//   search=true        the same with a wider beam, and with the figures of this machine where it was measured
//
// The schedule of the rules (autoschedule/default_schedule.h, memory_budget.h) stays where nothing is clearly better, or
// where sizes are not known. A prediction is right within some percent at best, so that a gain of less is none. Two models
// must agree: the cost of plans, and the prediction of the lowered program.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "autoschedule/memory_budget.h"
#include "frontend/run/schedule_report.h"
#include "ir/lowered_function.h"

namespace retrograde::driver {

struct ChosenSchedule {
  autoschedule::ScheduledGraph graph;
  SearchedSchedules search;
  std::optional<ir::LoweredFunction> lowered;  // the graph, if its schedule was chosen by it
};

// How a graph is lowered when it has its schedule.
struct Lowering {
  Target target;
  std::string name = "chosen";
  std::optional<std::vector<ir::LoweredArgument>> inputs = {};  // nullopt: what the graph reads

  ir::LoweredFunction lower(const std::vector<FuncPtr>& scheduled) const;
};

// How far from the schedule of the rules one may be taken. A report tells the best other schedule, too.
enum class Choosing : uint8_t { Rules, Search, SearchWithReport };

// `outputs`: of a graph whose wrappers have been applied, which stays as it is.
ChosenSchedule choose_schedule(const std::vector<FuncPtr>& outputs,
                               const autoschedule::ScheduleRequest& request,
                               autoschedule::Scheduling what, const Lowering& lowering,
                               Choosing choosing = Choosing::Search);

// Why a search that was asked for did not run, as SearchedSchedules::note tells it.
std::string note_against_search(const std::vector<FuncPtr>& outputs, const std::string& rule,
                                const std::string& evidence, const std::string& instead);

}  // namespace retrograde::driver
