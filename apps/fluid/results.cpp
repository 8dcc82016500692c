// results.cpp -- see results.h.
#include "results.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>

#include "checkpoints.h"
#include "common/files.h"
#include "common/images.h"
#include "common/process.h"

namespace fluid {

using nlohmann::json;

namespace {

constexpr int shown_side = 256;  // pixels to which a small box is magnified
constexpr int strip_pictures = 6;

Smoke smoke_of(const Scene& scene, std::vector<float> density) {
  return {scene.shape.width, scene.shape.height, std::move(density)};
}

// Writes the pictures of a run one after another, so that few are in memory at once.
class Film {
 public:
  Film(const Scene& scene, const std::filesystem::path& folder)
      : scene_(scene),
        folder_(folder),
        zoom_(std::max(1, shown_side / scene.shape.cells_per_unit())),
        animation_(scene.frames + 1, std::clamp(scene.frames / 4, 5, 30)) {
    remove_old_frames();
    apps::require_writable_folder(folder / "frames");
  }

  void add(const State<float>& state) {
    const float* first = state.density.data();
    last_ = to_image(smoke_of(scene_, {first, first + scene_.shape.cells()}), zoom_);
    char name[32];
    std::snprintf(name, sizeof name, "%04d.png", added_);
    apps::write_image(folder_ / "frames" / name, last_);
    animation_.add(last_);
    while (static_cast<int>(chosen_.size()) < strip_pictures && is_due()) chosen_.push_back(last_);
    ++added_;
  }

  void finish() {
    animation_.finish(folder_ / "animation.gif");
    apps::write_image(folder_ / "result.png", last_);
    apps::write_image(folder_ / "strip.png", strip_of(chosen_));
    apps::write_image(folder_ / "start.png", to_image(smoke_of(scene_, scene_.start), zoom_));
    apps::write_image(folder_ / "target.png", to_image(smoke_of(scene_, scene_.target), zoom_));
  }

 private:
  bool is_due() const {
    return added_ * (strip_pictures - 1) >= static_cast<int>(chosen_.size()) * scene_.frames;
  }

  // Frames of an earlier, longer run would otherwise follow this run's.
  void remove_old_frames() const {
    std::error_code ignored;
    for (const auto& entry : std::filesystem::directory_iterator(folder_ / "frames", ignored)) {
      const std::string name = entry.path().filename().string();
      if (name.size() == 8 && name.ends_with(".png")) {
        std::filesystem::remove(entry.path(), ignored);
      }
    }
  }

  const Scene& scene_;
  std::filesystem::path folder_;
  int zoom_, added_ = 0;
  Animation animation_;
  apps::Image last_;
  std::vector<apps::Image> chosen_;
};

json run_json(const MethodRun& run) {
  return {{"loss", run.best_loss},
          {"steps", run.steps()},
          {"seconds", run.seconds()},
          {"refused", run.refused},
          {"ended", run.ended}};
}

json own_part(const Control<float>& control, const Fit& fit, const Setup& setup,
              const Results& results) {
  const Scene& scene = control.scene();
  const Physics found = control.variables().physics(fit.best().best);
  json methods = json::object();
  for (const MethodRun& run : fit.runs) methods[apps::name_of(run.method)] = run_json(run);
  return {{"width", scene.shape.width},
          {"height", scene.shape.height},
          {"frames", scene.frames},
          {"variables", control.variables().size()},
          {"force_nodes", {scene.shape.force_width, scene.shape.force_height}},
          {"states_kept", setup.memory.slots},
          {"state_mb", setup.memory.state_mb},
          {"frames_computed_again", advances(scene.frames, setup.memory.slots)},
          {"compile_seconds", setup.compile_seconds},
          {"ms_per_frame", 1e3 * results.seconds_a_frame},
          {"ms_per_gradient", 1e3 * results.seconds_a_gradient},
          {"psnr_initial_db", results.psnr_before_db},
          {"psnr_final_db", results.psnr_db},
          {"loss", results.loss},
          {"time_step", found.time_step},
          {"viscosity", found.viscosity},
          {"diffusion", found.diffusion},
          {"left_out", setup.left_out},
          {"methods", methods}};
}

double seconds_a_frame(Control<float>& control, const std::vector<double>& x) {
  const auto start = std::chrono::steady_clock::now();
  control.play(x, [](const State<float>&) {});
  const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
  return taken.count() / control.scene().frames;
}

void add_pictures(apps::Report& report) {
  report.add_picture("start.png", "the smoke at the start");
  report.add_picture("target.png", "what it shall be");
  report.add_picture("result.png", "what the force made of it");
  report.add_picture("strip.png", "on the way");
  report.add_picture("animation.gif", "every frame");
}

void add_numbers(apps::Report& report, const Scene& scene, const Setup& setup,
                 const Results& results) {
  report.add_number("PSNR", results.psnr_db, "dB", results.psnr_before_db);
  report.add_number("loss", results.loss);
  report.add_number("a frame", 1e3 * results.seconds_a_frame, "ms");
  report.add_number("a gradient through all frames", 1e3 * results.seconds_a_gradient, "ms");
  report.add_number("frames", scene.frames);
  report.add_number("states kept", setup.memory.slots);
  report.add_number("peak memory", apps::peak_memory_mb(), "MB");
}

}  // namespace

double psnr_db(double mean_squared_difference) {
  return -10 * std::log10(std::max(mean_squared_difference, 1e-20));
}

Results write_results(const Options& options, Control<float>& control, const Fit& fit,
                      const Setup& setup, apps::Report& report) {
  const MethodRun& best = fit.best();
  Results results{};
  results.loss = control.loss(best.best);
  results.psnr_before_db = psnr_db(setup.difference);
  results.psnr_db = psnr_db(control.difference());
  results.seconds_a_frame = seconds_a_frame(control, best.best);
  results.seconds_a_gradient = fit.median_gradient_seconds();
  control.keep_states(1);
  Film film(control.scene(), options.common.output);
  control.play(best.best, [&](const State<float>& state) { film.add(state); });
  film.finish();

  report.own = own_part(control, fit, setup, results);
  add_numbers(report, control.scene(), setup, results);
  add_pictures(report);
  apps::Plot plot{.title = "loss against run time", .log_y = true};
  long steps = 0;
  for (const MethodRun& run : fit.runs) {
    plot.series.push_back(apps::loss_series(apps::name_of(run.method), run.series));
    steps = std::max(steps, run.steps());
  }
  report.add_plot(plot);
  report.write(steps, fit.stopped);
  return results;
}

}  // namespace fluid
