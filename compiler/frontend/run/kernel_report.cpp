// kernel_report.cpp -- reports of kernels as text and as JSON.
#include "frontend/run/kernel_report.h"

#include <algorithm>
#include <iomanip>
#include <nlohmann/json.hpp>
#include <sstream>

namespace retrograde {

std::string KernelReport::to_string() const {
  if (kernels.empty()) return "";
  size_t width = 12;
  for (const Kernel& kernel : kernels) width = std::max(width, kernel.name.size() + 2);
  std::ostringstream out;
  const auto row = [&](const std::vector<std::string>& cells) {
    out << std::left << std::setw(static_cast<int>(width)) << cells[0] << std::right;
    for (size_t i = 1; i < cells.size(); ++i) out << std::setw(14) << cells[i];
    out << "\n";
  };
  const auto number = [](const auto& value) { return value ? std::to_string(*value) : "-"; };
  row({"kernel", "threads", "shared bytes", "registers", "local bytes", "spilled"});
  for (const Kernel& kernel : kernels) {
    row({kernel.name, std::to_string(kernel.threads), number(kernel.shared_bytes),
         number(kernel.registers),
         std::to_string(std::max(kernel.local_bytes, kernel.stack_bytes.value_or(0))),
         number(kernel.spill_bytes)});
  }
  for (const Kernel& kernel : kernels) {
    for (const std::string& stage : kernel.loops) out << kernel.name << " runs " << stage << "\n";
  }
  out << assembler << "\n";
  for (const std::string& note : notes) out << note << "\n";
  return out.str();
}

std::string KernelReport::to_json() const {
  using Json = nlohmann::json;
  const auto optional = [](const auto& value) { return value ? Json(*value) : Json(); };
  Json json = {{"assembler", assembler}, {"notes", notes}, {"kernels", Json::array()}};
  for (const Kernel& kernel : kernels) {
    json["kernels"].push_back({{"name", kernel.name},
                               {"loops", kernel.loops},
                               {"threads", kernel.threads},
                               {"shared_bytes", optional(kernel.shared_bytes)},
                               {"local_bytes", kernel.local_bytes},
                               {"registers", optional(kernel.registers)},
                               {"stack_bytes", optional(kernel.stack_bytes)},
                               {"spill_bytes", optional(kernel.spill_bytes)}});
  }
  return json.dump(2) + "\n";
}

}  // namespace retrograde
