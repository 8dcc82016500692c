// explain_schedule.cpp -- predicted and measured times of a schedule, stage by stage.
#include <HalideRuntime.h>

#include <algorithm>
#include <iomanip>
#include <nlohmann/json.hpp>
#include <sstream>

#include "autoschedule/choose_schedule.h"
#include "autoschedule/machine/kept_machine.h"
#include "frontend/data/buffer.h"
#include "frontend/run/compiler_interface.h"
#include "graph/directives/schedule_log.h"
#include "tuning/explain_stages.h"
#include "tuning/kernels_taken.h"
#include "tuning/measure_stages.h"
#include "tuning/predict.h"

namespace retrograde {

namespace {

using tuning::BufferShape;

ScheduleReport::Stage stage_named(const std::string& name) {
  ScheduleReport::Stage stage;
  stage.name = name;
  return stage;
}

void add_stages(const tuning::Prediction& prediction, const std::vector<std::string>& funcs,
                ScheduleReport& report) {
  for (const tuning::StagePrediction& found : prediction.stages) {
    const std::string name = tuning::func_of_stage(found.name, funcs);
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

void add_measured(const tuning::MeasuredStages& measured, ScheduleReport& report) {
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

std::string milliseconds(const std::optional<double>& ms) {
  if (!ms) return "-";
  std::ostringstream out;
  out << std::fixed << std::setprecision(*ms < 1 ? 4 : 2) << *ms;
  return out.str();
}

std::string megabytes(double bytes) {
  std::ostringstream out;
  out << std::fixed << std::setprecision(2) << bytes / 1e6;
  return out.str();
}

}  // namespace

ScheduleReport explain_schedule(const PipelineSpec& pipeline,
                                const std::vector<halide_buffer_t*>& outputs, const Target& target,
                                const ExplainOptions& options, const JITHandlers& handlers) {
  autoschedule::ChosenSchedule chosen =
      autoschedule::choose_schedule(pipeline, target, options.runner_up);
  const std::vector<graph::FuncPtr>& scheduled = chosen.graph.outputs;
  std::vector<BufferShape> shapes;
  for (const halide_buffer_t* buffer : outputs) shapes.push_back(tuning::shape_of(*buffer));
  if (shapes.empty()) shapes = tuning::output_shapes(scheduled);
  const tuning::LoweredForReport lowered = tuning::lower_for_report(pipeline, scheduled, target);
  const ir::LoweredFunction& function = lowered.function;
  const planning::Machine machine = planning::machine_for(target);
  const int threads = options.threads > 0 ? options.threads : handlers.thread_limit;
  ScheduleReport report;
  report.schedule = graph::schedule_log(scheduled).to_cpp();
  report.machine = machine.name;
  report.search = std::move(chosen.search);
  std::vector<std::string> funcs;
  for (const graph::FuncPtr& f : graph::topological_order(scheduled)) funcs.push_back(f->name);
  add_stages(tuning::predict(function, tuning::program_sizes(function, shapes), machine, threads),
             funcs, report);
  report.kernels = tuning::kernels_taken(lowered, target);
  if (!options.measure) return report;
  std::vector<Buffer<>> made;
  std::vector<halide_buffer_t*> used = outputs;
  if (used.empty()) {
    made = make_buffers(scheduled, shapes);
    for (Buffer<>& buffer : made) used.push_back(buffer.raw_buffer());
  }
  add_measured(tuning::measure_stages(pipeline, scheduled, used, target, options, handlers),
               report);
  return report;
}

std::string ScheduleReport::to_string() const {
  std::ostringstream out;
  out << schedule << "\n";
  size_t width = 12;
  for (const Stage& stage : stages) width = std::max(width, stage.name.size() + 2);
  const auto name_width = static_cast<int>(width);
  const auto row = [&](const std::string& name, const std::string& predicted,
                       const std::string& measured, const std::string& bound,
                       const std::string& bytes) {
    out << std::left << std::setw(name_width) << name << std::right << std::setw(14) << predicted
        << std::setw(14) << measured << "  " << std::left << std::setw(9) << bound << std::right
        << std::setw(10) << bytes << "\n";
  };
  row("stage", "predicted ms", "measured ms", "bound by", "MB");
  for (const Stage& stage : stages) {
    row(stage.name.empty() ? "(none)" : stage.name, milliseconds(stage.predicted_ms),
        milliseconds(stage.measured_ms), stage.bound_by, megabytes(stage.bytes));
  }
  row("total", milliseconds(predicted_ms), milliseconds(measured_ms), "", "");
  out << "first call: " << milliseconds(first_call_ms) << " ms more, for new memory\n";
  out << "machine: " << machine << "\n" << search.to_string() << kernels.to_string();
  return out.str();
}

std::string SearchedSchedules::to_string() const {
  std::ostringstream out;
  if (!note.empty()) out << note << "\n";
  if (tried == 0) return out.str();
  out << "searched: " << tried << " schedules; this one " << milliseconds(predicted_ms)
      << " ms, that of the rules " << milliseconds(rules_ms) << " ms\n";
  if (!runner_up_ms) return out.str();
  out << "runner-up: " << milliseconds(runner_up_ms) << " ms\n" << runner_up;
  return out.str();
}

std::string ScheduleReport::to_json() const {
  using Json = nlohmann::json;
  const auto optional = [](const std::optional<double>& v) { return v ? Json(*v) : Json(); };
  Json json = {{"schedule", schedule},
               {"machine", machine},
               {"predicted_ms", predicted_ms},
               {"first_call_ms", first_call_ms},
               {"measured_ms", optional(measured_ms)},
               {"stages", Json::array()},
               {"kernels", Json::parse(kernels.to_json())},
               {"search",
                {{"tried", search.tried},
                 {"rules_ms", search.rules_ms},
                 {"predicted_ms", search.predicted_ms},
                 {"runner_up_ms", optional(search.runner_up_ms)},
                 {"runner_up", search.runner_up},
                 {"note", search.note}}}};
  for (const Stage& stage : stages) {
    json["stages"].push_back({{"name", stage.name},
                              {"predicted_ms", stage.predicted_ms},
                              {"measured_ms", optional(stage.measured_ms)},
                              {"bound_by", stage.bound_by},
                              {"bytes", stage.bytes},
                              {"memory_bytes", stage.memory_bytes}});
  }
  return json.dump(2) + "\n";
}

}  // namespace retrograde
