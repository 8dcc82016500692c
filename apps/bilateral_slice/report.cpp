// report.cpp -- see report.h.
#include "report.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "common/files.h"
#include "diagnostics/error.h"
#include "explain.h"
#include "trainer_state.h"

namespace bilateral_slice {

using nlohmann::json;
using retrograde::text;

namespace {

// Error against time: the loss before step n, at the time after the first n steps.
json curve_of(const Series& series) {
  json seconds = json::array(), psnr = json::array();
  double elapsed = 0;
  for (size_t n = 0; n < series.loss.size(); ++n) {
    seconds.push_back(elapsed);
    psnr.push_back(psnr_db(series.loss[n]));
    elapsed += series.seconds[n];
  }
  return {{"seconds", seconds}, {"psnr_db", psnr}, {"compile_seconds", series.compile_seconds}};
}

// The pictures on the page of all demos (common/make_index.py).
json pictures() {
  return {{{"file", "input.png"}, {"caption", "the photo"}},
          {{"file", "target.png"}, {"caption", "the look that it was given"}},
          {{"file", "result.png"}, {"caption", "what was learned of it"}},
          {{"file", "error_against_time.png"}, {"caption", "error against run time"}}};
}

json numbers_of(const Report& report, const Fit& fit) {
  json numbers = {
      {{"name", "PSNR"},
       {"before", report.psnr_initial_db},
       {"value", report.psnr_final_db},
       {"unit", "dB"}},
      {{"name", "a step"}, {"value", fit.ours.median_ms()}, {"unit", "ms"}},
      {{"name", "gradient check"}, {"value", report.gradient_check.max_relative_error}}};
  if (!fit.peer.seconds.empty())
    numbers.push_back(
        {{"name", "a step of Halide 14"}, {"value", fit.peer.median_ms()}, {"unit", "ms"}});
  return numbers;
}

json or_null(bool known, double value) { return known ? json(value) : json(nullptr); }

}  // namespace

double psnr_db(double mean_squared_error) {
  return -10 * std::log10(std::max(mean_squared_error, 1e-20));
}

void write_report(const std::filesystem::path& path, const Report& report, const Fit& fit) {
  const bool has_peer = !fit.peer.seconds.empty();
  const double ours = fit.ours.median_ms(), peer = has_peer ? fit.peer.median_ms() : 0;
  json out = {
      {"program", "bilateral_slice"},
      {"pictures", pictures()},
      {"numbers", numbers_of(report, fit)},
      {"width", report.shape.width},
      {"height", report.shape.height},
      {"channels", report.shape.channels},
      {"grid",
       {report.shape.grid_x, report.shape.grid_y, report.shape.grid_z,
        report.shape.channels * report.shape.coefficients()}},
      {"optimize", names_of(report.moves)},
      {"left_out", left_out(report.shape, report.moves)},
      {"threads", report.threads},
      {"steps", fit.ours.seconds.size()},
      {"stopped", fit.stopped},
      {"seconds", report.seconds},
      {"ms_per_step", ours},
      {"psnr_initial_db", report.psnr_initial_db},
      {"psnr_final_db", report.psnr_final_db},
      {"gradient_check_max_relative_error", report.gradient_check.max_relative_error},
      {"gradient_check_derivatives", report.gradient_check.compared},
      {"halide_steps", fit.peer.seconds.size()},
      {"halide_ms_per_step", or_null(has_peer, peer)},
      {"ratio_to_halide", or_null(has_peer, peer / ours)},
      {"halide_missing_because", fit.why_no_peer},
      {"peak_memory_mb", report.peak_memory_mb},
      {"retrograde", curve_of(fit.ours)},
      {"halide", curve_of(fit.peer)},
  };
  apps::write_file(path, out.dump(1) + "\n");
}

}  // namespace bilateral_slice
