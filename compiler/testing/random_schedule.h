// Random legal schedules as logs: wrappers, clones and factored updates; where each Func is
// computed and stored, how, and the loops of each of its stages.
#pragma once

#include "graph/schedule_log.h"
#include "testing/build_pipeline.h"

namespace retrograde::fuzz {

// Names are those of the Funcs without the numbers that the process gives them: f0, r.x. What
// specializations compare with is a Param of the log's own.
ScheduleLog random_schedule(const PipelineSpec& pipeline, uint64_t seed);

// The Params that only a log reads.
std::vector<std::shared_ptr<ir::ParameterContents>> parameters_of(const ScheduleLog& log);

// Gives it to the Funcs of a pipeline, outputs or not.
void apply(const ScheduleLog& log, const BuiltPipeline& built);

}  // namespace retrograde::fuzz
