// The schedule of the rules alone, for tests of one rule: a search would leave it where moves lead to less predicted time.
#pragma once

#include "autoschedule/default_schedule.h"
#include "autoschedule/memory_budget.h"
#include "frontend/run/compiled_pipeline.h"
#include "frontend/run/pipeline.h"
#include "graph/directives/schedule_log.h"
#include "graph/directives/wrappers.h"

namespace retrograde {

// As Pipeline::auto_schedule, which starts a search afterwards. Returns the directives.
inline ScheduleLog schedule_by_rules(const Pipeline& pipeline,
                                     const Target& target = get_host_target(),
                                     const AutoscheduleOptions& options = {},
                                     const MachineParams& machine = MachineParams::generic()) {
  const std::vector<graph::FuncPtr> outputs = pipeline.spec().outputs;
  const std::vector<graph::FuncPtr> wrapped = graph::apply_wrappers(outputs);
  const auto given = static_cast<std::ptrdiff_t>(graph::schedule_log(wrapped).size());
  ScheduleLog log =
      graph::schedule_log(autoschedule::schedule_within_budget(
                              wrapped, autoschedule::request_for(target, options, machine),
                              autoschedule::Scheduling::Everything)
                              .outputs);
  log.entries.erase(log.entries.begin(), log.entries.begin() + given);
  graph::apply_log(log, outputs);
  return log;
}

}  // namespace retrograde
