// choose_schedule.h -- the schedule of a graph by its options.
//
//   options            what is taken
//   (none)             the plan of the least cost to which a descent over moves leads (plan_schedule.h). It is the same on
//                      every machine, since figures are those of the target
//   search=true        the same with a wider beam, and with the figures of this machine where it was measured, if the
//                      cost of plans and the prediction of the lowered program agree that it is faster
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "driver/schedule_request.h"
#include "frontend/run/schedule_report.h"
#include "ir/lowered_function.h"

namespace retrograde::driver {

struct ChosenSchedule {
  ScheduledGraph graph;
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

// Whether the best other schedule of a search is wanted, too, whatever the options say.
enum class Choosing : uint8_t { Schedule, ScheduleAndRunnerUp };

// `outputs`: of a graph whose wrappers have been applied, which stays as it is.
ChosenSchedule choose_schedule(const std::vector<FuncPtr>& outputs, const ScheduleRequest& request,
                               Scheduling what, const Lowering& lowering,
                               Choosing choosing = Choosing::Schedule);

// Why a search that was asked for did not run, as SearchedSchedules::note tells it.
std::string note_against_search(const std::vector<FuncPtr>& outputs, const std::string& rule,
                                const std::string& evidence, const std::string& instead);

}  // namespace retrograde::driver
