// main.cpp -- bilateral_slice: learns a photographic look. See README.md in this folder.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <string>
#include <vector>

#include "batch.h"
#include "common/checks.h"
#include "common/files.h"
#include "common/images.h"
#include "common/plots.h"
#include "common/process.h"
#include "common/progress.h"
#include "common/report.h"
#include "common/run_app.h"
#include "common/state.h"
#include "common/timing.h"
#include "diagnostics/error.h"
#include "explain.h"
#include "fit.h"
#include "gradient_check.h"
#include "look.h"
#include "options.h"
#include "pairs.h"
#include "report.h"
#include "stability.h"
#include "step_times.h"
#include "trainer_state.h"

namespace bilateral_slice {

using retrograde::text;

namespace {

// Reads the pair; in colour if the initial look is.
Pair read_given_pair(const Options& options, const std::optional<Look>& start) {
  Pair pair = read_pair(options.input, options.target);
  if (options.grid > 0) pair.shape.grid_x = pair.shape.grid_y = options.grid;
  if (!start) return pair;
  require_fits(*start, options.start.string(), pair.shape.channels, options.input.string());
  if (start->channels == 3) make_colour(pair);
  pair.shape = start->shape(pair.shape.width, pair.shape.height);
  return pair;
}

apps::State read_given_state(const Options& options, const Shape& shape) {
  apps::State state = apps::read_state(options.output / "state.bin", "bilateral_slice");
  require_same_run(state, shape, options.moves);
  return state;
}

void write_planes(const std::filesystem::path& path, const Shape& shape, const Planes& planes,
                  int bits) {
  apps::write_png(path, to_image(shape, planes, bits));
}

Fit fit_with_progress(const Options& options, const std::optional<Look>& start, Pair& pair) {
  apps::Progress progress(stderr, static_cast<int>(options.steps));
  FitOptions how;
  how.steps = static_cast<int>(options.steps);
  how.threads = options.threads;
  how.seconds = options.seconds;
  how.peer_seconds = options.halide_seconds;
  how.moves = options.moves;
  how.start = start;
  if (options.resume) how.resume = read_given_state(options, pair.shape);
  return fit(pair.shape, pair.photo, pair.target, how, [&](int step, double loss) {
    char note[32];
    std::snprintf(note, sizeof note, "%.2f dB", psnr_db(loss));
    progress.show(step, note);
  });
}

void write_results(const Options& options, const Pair& pair, const Fit& fit, const Report& report) {
  write_planes(options.output / "input.png", pair.shape, pair.photo, pair.bits);
  write_planes(options.output / "target.png", pair.shape, pair.target, pair.bits);
  write_planes(options.output / "result.png", pair.shape, fit.result, pair.bits);
  write_look(options.output / "look.bin", fit.look);
  apps::write_state(options.output / "state.bin", fit.state);
  write_report(options.output / "report.json", report, fit);
  apps::draw_plot("plot_error_against_time.py", options.output / "report.json",
                  options.output / "error_against_time.png");
}

void print_summary(const Options& options, const Report& report, const Fit& fit) {
  std::printf("PSNR %.2f dB -> %.2f dB in %zu steps of %.1f ms, gradient check %.1e",
              report.psnr_initial_db, report.psnr_final_db, fit.ours.seconds.size(),
              fit.ours.median_ms(), report.gradient_check.max_relative_error);
  if (!fit.peer.seconds.empty()) {
    std::printf(", Halide 14 %.1f ms: %.2f times", fit.peer.median_ms(),
                fit.peer.median_ms() / fit.ours.median_ms());
  }
  std::printf("%s\nresults in %s\n", fit.stopped ? "; it was stopped" : "", options.output.c_str());
  if (!fit.why_no_peer.empty()) std::fprintf(stderr, "%s\n", fit.why_no_peer.c_str());
}

// --check-gradients
void check_gradients(const Options& options, const Pair& pair) {
  apps::Report table("bilateral_slice", options);
  const retrograde::GradientReport report = check_gradients_in_full(
      pair.shape, pair.photo.data(), pair.target.data(), {options.moves, options.check_side});
  const auto json = options.output / "gradients.json", plot = options.output / "gradients.png";
  apps::write_file(json, report.to_json() + "\n");
  apps::draw_plot("plot_report.py", json, plot);
  std::printf(
      "input: adjoint in double against complex step, tangent; in float32 against double\n");
  for (const auto& input : report.inputs) {
    std::printf("%s: %.1e, %.1e; %.1e\n", input.name.c_str(), input.complex_step_error,
                input.dot_product_error, input.own_precision_error);
  }
  std::printf("loses digits: %s\nreport in %s, drawn in %s\n",
              report.loses_digits.empty() ? "no Func" : report.loses_digits.c_str(), json.c_str(),
              plot.c_str());
  const auto rows = apps::gradient_rows(report);
  table.add_table(apps::gradient_table(rows));
  table.write(0, false);
  apps::require_gradients(rows);
}

// --apply
void apply_look(const Options& options) {
  const Look look = read_look(options.apply);
  const apps::Image photo = read_gray_or_colour(options.input);
  require_fits(look, options.apply.string(), photo.channels, options.input.string());
  const Shape shape = look.shape(photo.width, photo.height);
  Planes planes = to_planes(photo, shape.channels, true);
  write_planes(options.output / "result.png", shape, through_look(look, shape, planes), photo.bits);
  std::printf("the photo through the look is %s\n", (options.output / "result.png").c_str());
}

// --check-stability
void write_stability(const Options& options) {
  apps::Report report("bilateral_slice", options);
  const apps::Table table = apps::stability_table(check_stability());
  report.add_table(table);
  report.write(0, false);
  std::fputs(table.to_markdown().c_str(), stdout);
}

// --time-steps
void write_step_times(const Options& options, Pair pair) {
  apps::Report report("bilateral_slice", options);
  make_colour(pair);
  const apps::Table table = time_steps(pair, options.threads);
  report.add_table(table);
  report.write(0, false);
  std::fputs(table.to_markdown().c_str(), stdout);
}

std::optional<Look> read_start(const Options& options) {
  if (options.start.empty()) return std::nullopt;
  return read_look(options.start);
}

void run(const Options& options) {
  const apps::RunScope scope(options);
  const auto begun = std::chrono::steady_clock::now();
  if (!options.apply.empty()) return apply_look(options);
  const std::optional<Look> start = read_start(options);
  if (!options.pairs.empty()) return learn_from_pairs(options, start);
  if (options.check_stability) return write_stability(options);
  Pair pair = read_given_pair(options, start);
  if (options.explain) explain(pair.shape, options.moves);
  if (options.check_gradients) return check_gradients(options, pair);
  if (options.time_steps) return write_step_times(options, std::move(pair));
  Report report;
  report.shape = pair.shape;
  report.moves = options.moves;
  report.threads = options.threads;
  report.psnr_initial_db =
      psnr_db(mean_squared_difference(pair.photo, pair.target, pair.shape.samples()));
  report.gradient_check =
      check_gradient(pair.shape, pair.photo.data(), pair.target.data(), {options.moves, 0});
  const Fit fit = fit_with_progress(options, start, pair);
  report.psnr_final_db =
      psnr_db(mean_squared_difference(fit.result, pair.target, pair.shape.samples()));
  report.seconds = apps::seconds_since(begun);
  report.peak_memory_mb = apps::peak_memory_mb();
  write_results(options, pair, fit, report);
  print_summary(options, report, fit);
}

}  // namespace

}  // namespace bilateral_slice

int main(int argc, char** argv) {
  return apps::run_app("bilateral_slice", argc, argv, [](int c, char** v) {
    if (const auto options = bilateral_slice::read_options(c, v)) bilateral_slice::run(*options);
  });
}
