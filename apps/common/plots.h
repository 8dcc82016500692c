// plots.h -- reports drawn as PNG by Python's matplotlib.
#pragma once

#include <filesystem>
#include <string>

namespace apps {

// Runs `script report plot`. The script is found beside this program, or where it is installed.
// Throws retrograde::UserError when it is not drawn.
void draw_plot(const std::string& script, const std::filesystem::path& report,
               const std::filesystem::path& plot);

// Draws what report.json lists under "plots", each beside it, by plot_series.py.
void draw_plots(const std::filesystem::path& report);

}  // namespace apps
