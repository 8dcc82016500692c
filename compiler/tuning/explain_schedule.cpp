#include "tuning/explain_schedule.h"

#include <HalideRuntime.h>

#include <algorithm>

#include "autoschedule/machine/kept_machine.h"
#include "frontend/data/buffer.h"
#include "graph/directives/schedule_log.h"
#include "tuning/explain_stages.h"
#include "tuning/kernels_taken.h"
#include "tuning/measure_stages.h"
#include "tuning/predict.h"

namespace retrograde::tuning {

namespace {

ScheduleReport::Stage stage_named(const std::string& name) {
  ScheduleReport::Stage stage;
  stage.name = name;
  return stage;
}

void add_stages(const Prediction& prediction, const std::vector<std::string>& funcs,
                ScheduleReport& report) {
  for (const StagePrediction& found : prediction.stages) {
    const std::string name = func_of_stage(found.name, funcs);
    auto at = std::ranges::find(report.stages, name, &ScheduleReport::Stage::name);
    if (at == report.stages.end()) at = report.stages.insert(at, stage_named(name));
    // Of several places, the slowest says what bounds it.
    if (1e3 * found.seconds >= at->predicted_ms) at->bound_by = found.bound_by();
    at->predicted_ms += 1e3 * found.seconds;
    for (const double bytes : found.bytes) at->bytes += bytes;
    at->memory_bytes += found.bytes.back();
  }
  report.predicted_ms = 1e3 * prediction.seconds;
  report.first_call_ms = 1e3 * prediction.first_call_seconds;
}

void add_measured(const MeasuredStages& measured, ScheduleReport& report) {
  report.measured_ms = 1e3 * measured.total_seconds;
  for (const auto& [func, seconds] : measured.seconds) {
    const std::string name = func == "overhead" ? "" : func;
    auto at = std::ranges::find(report.stages, name, &ScheduleReport::Stage::name);
    if (at == report.stages.end()) {
      if (seconds == 0) continue;
      at = report.stages.insert(at, stage_named(name));
    }
    at->measured_ms = 1e3 * seconds;
  }
}

// Buffers of these shapes, one after the other.
std::vector<Buffer<>> make_buffers(const std::vector<graph::FuncPtr>& outputs,
                                   const std::vector<BufferShape>& shapes) {
  std::vector<Buffer<>> result;
  for (const graph::FuncPtr& f : outputs) {
    for (const Type& type : f->types) {
      const BufferShape& shape = shapes[result.size()];
      std::vector<int> sizes;
      for (const BufferShape::Dim& dim : shape.dims) sizes.push_back(static_cast<int>(dim.extent));
      result.emplace_back(type, sizes);
    }
  }
  return result;
}

}  // namespace

ScheduleReport explain_schedule(const PipelineSpec& pipeline,
                                const std::vector<graph::FuncPtr>& scheduled,
                                const std::vector<halide_buffer_t*>& outputs, const Target& target,
                                const ExplainOptions& options, const JITHandlers& handlers) {
  std::vector<BufferShape> shapes;
  for (const halide_buffer_t* buffer : outputs) shapes.push_back(shape_of(*buffer));
  if (shapes.empty()) shapes = output_shapes(scheduled);
  const LoweredForReport lowered = lower_for_report(pipeline, scheduled, target);
  const ir::LoweredFunction& function = lowered.function;
  const planning::Machine machine = planning::machine_for(target);
  const int threads = options.threads > 0 ? options.threads : handlers.thread_limit;
  ScheduleReport report;
  report.schedule = graph::schedule_log(scheduled).to_cpp();
  report.machine = machine.name;
  std::vector<std::string> funcs;
  for (const graph::FuncPtr& f : graph::topological_order(scheduled)) funcs.push_back(f->name);
  add_stages(predict(function, program_sizes(function, shapes), machine, threads), funcs, report);
  report.kernels = kernels_taken(lowered, target);
  if (!options.measure) return report;
  std::vector<Buffer<>> made;
  std::vector<halide_buffer_t*> used = outputs;
  if (used.empty()) {
    made = make_buffers(scheduled, shapes);
    for (Buffer<>& buffer : made) used.push_back(buffer.raw_buffer());
  }
  add_measured(measure_stages(pipeline, scheduled, used, target, options, handlers), report);
  return report;
}

}  // namespace retrograde::tuning
