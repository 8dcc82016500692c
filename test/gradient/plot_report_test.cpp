// Tests that tools/plot_report draws the reports of both checks, even with NaN and infinities in them, and refuses
// other files.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>

#include "checks/check_gradients.h"
#include "checks/check_stability.h"
#include "support/temporary_folder.h"

namespace retrograde {
namespace {

constexpr double inf = std::numeric_limits<double>::infinity();

class PlotReport : public ::testing::Test {
 protected:
  TemporaryFolder folder_;
  const std::filesystem::path plot_ = folder_.path() / "plot.png";

  int draw(const std::string& json) {
    const auto report = folder_.path() / "report.json";
    std::ofstream(report) << json;
    // Debian's Python is the one that has Debian's matplotlib.
    const char* python =
        std::filesystem::exists("/usr/bin/python3") ? "/usr/bin/python3" : "python3";
    return std::system((std::string(python) + " " RETROGRADE_TEST_DIR "/../tools/plot_report " +
                        report.string() + " " + plot_.string() + " 2> /dev/null")
                           .c_str());
  }
  void expect_png() {
    std::ifstream file(plot_);
    std::string start(8, ' ');
    file.read(start.data(), 8);
    EXPECT_EQ(start, "\x89PNG\r\n\x1a\n");
    EXPECT_GT(std::filesystem::file_size(plot_), 10000u);
  }
};

TEST_F(PlotReport, DrawsGradients) {
  GradientReport report;
  GradientReport::Input input;
  input.name = "image";
  input.steps = {{0.0625, 1e-3, 1e-5, 0.01}, {0.03125, std::nan(""), 0, 0.01}};
  input.methods = {{"differences", 1e-9, 0.1}, {"complex step", 0, 0.02}, {"odd", inf, 0}};
  report.inputs = {input, input};
  report.funcs = {{"f", 1e-7, 1}, {"g", inf, inf}};
  report.loses_digits = "g";
  ASSERT_EQ(draw(report.to_json()), 0);
  expect_png();
}

TEST_F(PlotReport, DrawsStability) {
  StabilityReport report;
  StabilityReport::FuncResult fine{"f", false, 0, 1e-7, 1, 2}, lost{"f", true, 1, inf, 0, 0, 3, 1};
  StabilityReport::Place place{"f", true, 1, {3, 4}, inf, 1, "x*x"};
  report.cases = {{"as bound", {fine, fine}, {}, {}}, {"zeros", {fine, lost}, place, place}};
  report.left_out = {{"wave", "no region"}};
  ASSERT_EQ(draw(report.to_json()), 0);
  expect_png();
}

TEST_F(PlotReport, RefusesWhatIsNoReport) {
  EXPECT_NE(draw("{\"check\": \"weather\"}"), 0);
  EXPECT_NE(draw("no JSON"), 0);
  EXPECT_FALSE(std::filesystem::exists(plot_));
}

}  // namespace
}  // namespace retrograde
