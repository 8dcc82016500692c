// main.cpp -- fluid: finds forces that turn smoke into a picture. See README.md in this folder.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <string>

#include "common/checks.h"
#include "common/process.h"
#include "common/progress.h"
#include "common/report.h"
#include "common/run_app.h"
#include "diagnostics/error.h"
#include "fit.h"
#include "gradient_check.h"
#include "memory_plan.h"
#include "options.h"
#include "results.h"
#include "smoke.h"
#include "stability_check.h"

namespace fluid {

using retrograde::quoted;
using retrograde::text;

namespace {

void require_smoke(const std::filesystem::path& path, const Smoke& picture) {
  if (picture.total() > 0) return;
  retrograde::call_error(text("take smoke from ", quoted(path.string())),
                         "there must be smoke in the picture: what is bright is smoke",
                         "all of it is black", "Give another picture, or its negative");
}

Smoke start_like(const Options& options, const Smoke& target) {
  if (options.start.empty()) return disc_like(target);
  const Smoke start = read_smoke_like(options.start, target);
  require_smoke(options.start, start);
  return start;
}

Scene make_scene(const Options& options) {
  const Smoke picture = read_smoke(options.common.input);
  require_smoke(options.common.input, picture);
  const Cells cells = cells_for(picture, options.cells, options.common.input);
  Scene scene;
  FrameShape& s = scene.shape;
  s.width = cells.width;
  s.height = cells.height;
  const auto nodes = [&](int cells) {
    if (options.force_nodes == 0 || options.force_nodes >= s.cells_per_unit()) return cells;
    return std::max(2, options.force_nodes * cells / s.cells_per_unit());
  };
  s.force_width = nodes(s.width);
  s.force_height = nodes(s.height);
  scene.wanted = {
      apps::optimizes(options.common, "force"), apps::optimizes(options.common, "time_step"),
      apps::optimizes(options.common, "viscosity"), apps::optimizes(options.common, "diffusion")};
  s.has_force = scene.wanted.force || !options.force_from.empty();
  s.has_viscosity = options.physics.viscosity > 0;
  s.has_diffusion = options.physics.diffusion > 0;
  s.solver = options.solver;
  s.iterations = options.iterations;
  scene.frames = options.frames;
  scene.physics = options.physics;
  scene.swirl = options.swirl;
  scene.reach = options.reach;
  scene.effort = options.effort;
  // Checked before anything of that size is allocated.
  require_memory_for_a_frame(scene, options.common.memory_mb);
  const Smoke target = resample(picture, s.width, s.height);
  scene.target = target.density;
  scene.start = start_like(options, target).density;
  return scene;
}

void read_force_of_scene(const Options& options, Scene& scene) {
  if (options.force_from.empty()) return;
  scene.force =
      read_force(options.force_from, static_cast<size_t>(scene.frames) * scene.shape.force_elems());
}

// The force is the given one if it is optimized; the other variables have their initial values.
std::vector<double> start_of(const Scene& scene, const Variables& variables) {
  std::vector<double> x = variables.start();
  if (variables.force_size() > 0) std::copy(scene.force.begin(), scene.force.end(), x.begin());
  return x;
}

void run_gradient_check(const Options& options, const Scene& scene) {
  const auto rows = check_gradients(scene, options.common.seed);
  apps::report_tables("fluid", options.common, {apps::gradient_table(rows)});
  apps::require_gradients(rows);
}

void run_stability_check(const Options& options, const Scene& scene) {
  apps::Progress progress(stderr, 21);
  const auto rows =
      check_stability(scene, options.common.seed,
                      [&](int done, int, const std::string& name) { progress.show(done, name); });
  apps::report_tables("fluid", options.common, {apps::stability_table(rows)});
}

void explain(Control<float>& control, const std::vector<std::string>& left_out) {
  std::printf("%s", control.simulation().adjoint().derivative.explain().c_str());
  for (const std::string& line : left_out) std::printf("left out of the frame: %s\n", line.c_str());
}

Fit fit_with_progress(const Options& options, Control<float>& control,
                      const std::vector<double>& start) {
  const int methods = static_cast<int>(options.methods.size());
  const auto steps = static_cast<int>(options.common.steps);
  apps::Progress progress(stderr, methods * steps);
  return optimize(options, control, start, [&](const std::string& name, long step, double loss) {
    int before = 0;
    while (before < methods && apps::name_of(options.methods[before]) != name) ++before;
    char note[64];
    std::snprintf(note, sizeof note, "%s: loss %.3g", name.c_str(), loss);
    progress.show(before * steps + static_cast<int>(step), note);
  });
}

void print_summary(const Options& options, const Setup& setup, const Fit& fit, const Results& r) {
  std::printf(
      "PSNR %.2f dB -> %.2f dB in %ld steps of %s, %.2f ms a frame, %.1f ms a gradient "
      "through %d frames with %d kept\n",
      r.psnr_before_db, r.psnr_db, fit.best().steps(), apps::name_of(fit.best().method).c_str(),
      1e3 * r.seconds_a_frame, 1e3 * r.seconds_a_gradient, options.frames, setup.memory.slots);
  std::printf("results in %s\n", options.common.output.c_str());
  if (fit.stopped) std::fprintf(stderr, "stopped: --resume goes on from here\n");
}

void run(const Options& options) {
  Scene scene = make_scene(options);
  read_force_of_scene(options, scene);
  const apps::RunScope scope(options.common);
  if (options.common.check_gradients) return run_gradient_check(options, scene);
  if (options.common.check_stability) return run_stability_check(options, scene);

  apps::Report report("fluid", options.common);
  Setup setup;
  const auto begin = std::chrono::steady_clock::now();
  Control<float> control(scene);
  control.compile();
  setup.compile_seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  setup.left_out = control.simulation().adjoint().frame.left_out();
  if (options.common.explain) explain(control, setup.left_out);
  setup.memory =
      plan_memory(scene, options.methods, options.common.memory_mb, apps::peak_memory_mb());
  control.keep_states(setup.memory.slots);
  const std::vector<double> start = start_of(scene, control.variables());
  control.loss(start);
  setup.difference = control.difference();
  const Fit fit = fit_with_progress(options, control, start);
  const Results results = write_results(options, control, fit, setup, report);
  print_summary(options, setup, fit, results);
}

}  // namespace

}  // namespace fluid

int main(int argc, char** argv) {
  return apps::run_app("fluid", argc, argv, [](int c, char** v) {
    if (const auto options = fluid::read_options(c, v)) fluid::run(*options);
  });
}
