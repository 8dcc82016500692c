// main.cpp -- burst_superresolution: computes one picture from many frames. See README.md in this folder.
#include <cstdio>

#include "checks.h"
#include "common/progress.h"
#include "common/run_app.h"
#include "options.h"
#include "pilot.h"
#include "results.h"

namespace burst {

namespace {

constexpr const char* name = "burst_superresolution";

Burst burst_of(const Options& options) {
  if (std::filesystem::is_directory(options.common.input))
    return read_burst(options.common.input, options.pattern);
  return simulate(demosaic::read_photograph(options.common.input), options.simulation);
}

void print_explanation(const Options& options, const Prepared& prepared,
                       const Evaluator<float>& evaluator) {
  for (const std::string& line : left_out(evaluator.shape(), prepared.smoothness, options.moves))
    std::printf("left out: %s\n", line.c_str());
  std::printf("%s\n", evaluator.explain().c_str());
}

std::string note_of(const Sample& sample) {
  char note[64];
  std::snprintf(note, sizeof note, "loss %.5g", sample.loss);
  std::string text = note;
  if (sample.psnr_db == sample.psnr_db) {
    std::snprintf(note, sizeof note, ", %.2f dB", sample.psnr_db);
    text += note;
  }
  return text;
}

Fit fit_with_progress(const Options& options, const Burst& burst, const Prepared& prepared,
                      Evaluator<float>& evaluator) {
  apps::Progress progress(stderr, static_cast<int>(options.common.steps));
  return fit(options, burst, prepared, evaluator, [&](const Sample& sample) {
    progress.show(static_cast<int>(sample.step), note_of(sample));
  });
}

void run(const Options& options) {
  const apps::RunScope scope(options.common);
  Burst burst = burst_of(options);
  if (options.common.check_gradients) {
    const auto rows = check_gradients(burst, options.common.seed);
    apps::report_tables(name, options.common, {apps::gradient_table(rows)});
    return apps::require_gradients(rows);
  }
  if (options.common.check_stability) {
    const auto rows = check_stability(burst, options.common.seed, options.common.threads);
    return apps::report_tables(name, options.common, {apps::stability_table(rows)});
  }
  apps::Report report(name, options.common);
  Prepared prepared = prepare(burst, options.colours, options.lambda, options.common.threads);
  Evaluator<float> evaluator({burst.size, burst.frames()}, prepared.smoothness, options.moves,
                             options.common.threads);
  evaluator.set_frames(burst.samples);
  choose_smoothness(options, burst, prepared, evaluator);
  if (options.common.explain) print_explanation(options, prepared, evaluator);
  const Fit fit = fit_with_progress(options, burst, prepared, evaluator);
  const Run done{options, burst, prepared, evaluator, fit, evaluator.compile_seconds()};
  if (options.write_frames) write_frames(options.common.output / "frames", burst);
  write_results(done, report);
  print_summary(done);
}

}  // namespace

}  // namespace burst

int main(int argc, char** argv) {
  return apps::run_app(burst::name, argc, argv, [](int count, char** words) {
    if (const auto options = burst::read_options(count, words)) burst::run(*options);
  });
}
