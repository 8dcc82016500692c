// plots.h -- draws reports as PNG with Python's matplotlib.
#pragma once

#include <filesystem>
#include <string>

namespace apps {

// Runs `script report plot`. The script is searched beside this program and where it is installed. Throws
// retrograde::UserError on failure.
void draw_plot(const std::string& script, const std::filesystem::path& report,
               const std::filesystem::path& plot);

// Draws the plots that report.json lists under "plots", each beside the report, with plot_series.py.
void draw_plots(const std::filesystem::path& report);

}  // namespace apps
