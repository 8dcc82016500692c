// explain_schedule.h -- predicted and measured times of a scheduled pipeline, stage by stage.
#pragma once

#include <vector>

#include "frontend/run/compiled_pipeline.h"
#include "frontend/run/schedule_report.h"

namespace retrograde::tuning {

// `scheduled`: the pipeline's outputs with the schedule that was chosen. Without outputs, sizes are the estimates. The
// report says nothing of a search.
ScheduleReport explain_schedule(const PipelineSpec& pipeline,
                                const std::vector<graph::FuncPtr>& scheduled,
                                const std::vector<halide_buffer_t*>& outputs, const Target& target,
                                const ExplainOptions& options, const JITHandlers& handlers);

}  // namespace retrograde::tuning
