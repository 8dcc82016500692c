#include "driver/reports.h"

#include "driver/schedule.h"
#include "tuning/explain_schedule.h"
#include "tuning/kernels_taken.h"

namespace retrograde::driver {

ScheduleReport explain_schedule(const PipelineSpec& pipeline,
                                const std::vector<halide_buffer_t*>& outputs, const Target& target,
                                const ExplainOptions& options, const JITHandlers& handlers) {
  ChosenSchedule chosen = schedule(
      pipeline, {target}, options.runner_up ? Choosing::ScheduleAndRunnerUp : Choosing::Schedule);
  ScheduleReport report =
      tuning::explain_schedule(pipeline, chosen.graph.outputs, outputs, target, options, handlers);
  report.search = std::move(chosen.search);
  return report;
}

KernelReport explain_kernels(const PipelineSpec& pipeline, const Target& target) {
  return tuning::kernels_taken(
      tuning::lower_for_report(pipeline, schedule(pipeline, {target}).graph.outputs, target),
      target);
}

tuning::ExplainedPipeline explain_stages(
    const PipelineSpec& pipeline, const Target& target,
    const std::vector<std::vector<int>>& output_sizes,
    const std::map<std::string, std::vector<int>>& input_sizes) {
  return tuning::explain_stages(pipeline, schedule(pipeline, {target}).graph.outputs, target,
                                output_sizes, input_sizes);
}

}  // namespace retrograde::driver
