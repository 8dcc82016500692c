// schedule_report.cpp -- reports of schedules and of searches as text and as JSON.
#include "frontend/run/schedule_report.h"

#include <algorithm>
#include <iomanip>
#include <nlohmann/json.hpp>
#include <sstream>

namespace retrograde {

namespace {

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
      << " ms, the default one " << milliseconds(default_ms) << " ms\n";
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
                 {"default_ms", search.default_ms},
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
