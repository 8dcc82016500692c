// schedule.h -- the schedule of a pipeline, whoever compiles it: in process, ahead of time, for a report or for Python.
//
//   Funcs => wrappers applied => graph rewrites => directives of the autoscheduler => lowering
//
// Only this file and auto_schedule.cpp know the order of these steps. They need every layer from `transform` to
// `tuning`, so they stand above all of them.
#pragma once

#include <vector>

#include "driver/choose_schedule.h"
#include "frontend/run/compiled_pipeline.h"
#include "frontend/run/pipeline.h"

namespace retrograde::driver {

// The graph that is lowered: the pipeline's outputs with their wrappers applied or, if there are adjoints or Funcs whose
// inlining would explode code size, those of a copy that has its schedule.
ChosenSchedule schedule(const PipelineSpec& pipeline, const Lowering& lowering,
                        Choosing choosing = Choosing::Schedule);
// The same, lowered.
ir::LoweredFunction schedule_and_lower(const PipelineSpec& pipeline, const Lowering& lowering);

// The outputs of the graph that is lowered.
std::vector<FuncPtr> schedule_unscheduled(const std::vector<FuncPtr>& outputs,
                                          const ScheduleRequest& request = {});

// A copy of the pipeline with the schedule of auto_schedule() for the target. In the copy, costly factors of sums and
// values of coarse grids are Funcs of their own, and sums leave out zeros between elements. If the user gave directives
// and the target has no GPU, the copy keeps those instead.
Pipeline scheduled_copy(const Pipeline& pipeline, const Target& target);

}  // namespace retrograde::driver
