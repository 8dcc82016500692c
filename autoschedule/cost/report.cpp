#include <iomanip>
#include <sstream>

#include "autoschedule/cost/cost.h"

namespace retrograde::planning {

namespace {

// Three significant digits; in goldens, two machines may differ in the last bit.
std::string number(double value) {
  std::ostringstream out;
  out << std::setprecision(3) << value;
  return out.str();
}

}  // namespace

std::string to_text(const Cost& cost, const Plan& plan) {
  std::ostringstream out;
  const auto row = [&](const std::string& name, const std::vector<std::string>& cells) {
    out << std::left << std::setw(28) << name;
    for (const std::string& cell : cells) out << std::right << std::setw(10) << cell;
    out << "\n";
  };
  row("stage", {"us", "compute", "launch", "L2 KB", "L3 KB", "mem KB", "bound by"});
  for (const StageCost& stage : cost.stages) {
    const graph::FuncContents& f = *plan.program->funcs[static_cast<size_t>(stage.stage.func)];
    std::string name = f.name;
    if (f.stage_count() > 1) name += "." + std::to_string(stage.stage.stage);
    std::vector<std::string> cells{number(stage.seconds * 1e6), number(stage.compute_seconds * 1e6),
                                   number(stage.launch_seconds * 1e6)};
    for (size_t level = 1; level < Machine::level_count; ++level)
      cells.push_back(number(stage.bytes[level] / 1e3));
    cells.push_back(stage.bound_by());
    row(name, cells);
  }
  row("total", {number(cost.seconds * 1e6)});
  row("peak KB", {number(cost.peak_bytes / 1e3)});
  return out.str();
}

}  // namespace retrograde::planning
