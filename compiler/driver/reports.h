// reports.h -- explanations of the schedule that is compiled.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "frontend/run/compiled_pipeline.h"
#include "frontend/run/schedule_report.h"
#include "tuning/explain_stages.h"

namespace retrograde::driver {

// Implements Pipeline::explain_schedule. Without outputs, sizes are the estimates.
ScheduleReport explain_schedule(const PipelineSpec& pipeline,
                                const std::vector<halide_buffer_t*>& outputs, const Target& target,
                                const ExplainOptions& options, const JITHandlers& handlers);

// Implements explain_kernels of frontend/run/kernel_report.h.
KernelReport explain_kernels(const PipelineSpec& pipeline, const Target& target);

// tuning::explain_stages of the schedule that is compiled.
tuning::ExplainedPipeline explain_stages(
    const PipelineSpec& pipeline, const Target& target,
    const std::vector<std::vector<int>>& output_sizes,
    const std::map<std::string, std::vector<int>>& input_sizes);

}  // namespace retrograde::driver
