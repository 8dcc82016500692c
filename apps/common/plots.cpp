// plots.cpp -- see plots.h.
#include "common/plots.h"

#include <cstdlib>

#include "common/process.h"
#include "diagnostics/error.h"

namespace apps {

using retrograde::text;

namespace {

std::filesystem::path find_script(const std::string& script_name) {
  const auto here = program_folder();
  // Looks relative to installed programs and the build's tests, and then to the build's programs, apps/NAME/NAME.
  for (const auto& above : {here / "..", here / ".." / ".."}) {
    const auto place = above / "share" / "retrograde" / script_name;
    if (std::filesystem::exists(place)) return place;
  }
  return script_name;
}

// Debian's Python has Debian's matplotlib; another one that is first on the path may not.
std::string find_python() {
  if (const char* chosen = std::getenv("RETROGRADE_PYTHON")) return chosen;
  return std::filesystem::exists("/usr/bin/python3") ? "/usr/bin/python3" : "python3";
}

std::string last_line(std::string output) {
  while (!output.empty() && output.back() == '\n') output.pop_back();
  const size_t start = output.rfind('\n');
  return start == std::string::npos ? output : output.substr(start + 1);
}

}  // namespace

void draw_plot(const std::string& script_name, const std::filesystem::path& report,
               const std::filesystem::path& plot) {
  const std::string script = find_script(script_name).string();
  const Outcome outcome = run_program({find_python(), script, report.string(), plot.string()});
  if (outcome.started && outcome.status == 0) return;
  retrograde::call_error(
      text("draw ", retrograde::quoted(plot.string())),
      "the plot is drawn by Python with matplotlib",
      outcome.started ? text(script_name, " ended with status ", outcome.status, ", saying \"",
                             last_line(outcome.output), "\"")
                      : text(find_python(), " did not start"),
      "Install python3-matplotlib, or set RETROGRADE_PYTHON to a Python that has it; all other "
      "results are written");
}

void draw_plots(const std::filesystem::path& report) {
  draw_plot("plot_series.py", report, report.parent_path());
}

}  // namespace apps
