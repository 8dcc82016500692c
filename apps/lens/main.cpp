// main.cpp -- lens: makes a lens shorter. See README.md in this folder.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <optional>

#include "checks.h"
#include "common/files.h"
#include "common/plots.h"
#include "common/progress.h"
#include "common/report.h"
#include "common/run_app.h"
#include "common/state.h"
#include "common/stop.h"
#include "diagnostics/error.h"
#include "drawing.h"
#include "options.h"
#include "paraxial.h"
#include "reference_trace.h"
#include "shorten.h"

namespace lens {

using retrograde::text;

namespace {

SceneOptions scene_options(const Options& options) {
  return {options.common.optimize, options.fields, options.wavelengths};
}

// A run and its resulting lens.
struct Result {
  Run run;
  Lens lens;
  SpotReport spots;
};

SpotReport judge(const Scene& scene, const Lens& lens) {
  return spots(lens, scene.fields_degrees, scene.wavelengths, scene.pupil_radius);
}

// The state for resuming a run: its stage, and the best numbers in that stage.
class SavedRun {
 public:
  SavedRun(const Options& options, const Scene& scene)
      : path_(options.common.output / "state.bin"),
        options_(options),
        size_(scene.variables.size()) {}

  void resume(ShortenOptions& how) const {
    if (!options_.common.resume) return;
    const apps::State state = apps::read_state(path_, "lens");
    how.x = state.array("numbers", size_);
    how.first_stage = static_cast<int>(state.array("stage", 1)[0]);
  }

  void save(int stage, const Run& run) const {
    apps::State state{.program = "lens", .step = run.steps};
    state.arrays["numbers"] = run.x;
    state.arrays["stage"] = {static_cast<double>(stage)};
    apps::write_state(path_, state);
  }

 private:
  std::filesystem::path path_;
  const Options& options_;
  size_t size_;
};

Result run_method(const Options& options, const Scene& scene, Evaluator& evaluator,
                  apps::Method method) {
  const SavedRun saved(options, scene);
  ShortenOptions how;
  how.method = method;
  how.shorter = options.shorter_percent / 100;
  how.steps = options.common.steps;
  how.seconds = options.common.seconds;
  how.stages = options.stages;
  saved.resume(how);
  if (method == apps::Method::NewtonCg)
    evaluator.compile_product();  // so that it does not count as run time
  apps::Progress progress(stderr, static_cast<int>(how.steps));
  int last_stage = how.first_stage;
  Result result;
  result.run = shorten(evaluator, scene, how,
                       [&](int stage, long step, double loss, std::span<const double>) {
                         last_stage = stage;
                         char note[64];
                         std::snprintf(note, sizeof note, "%s, stage %d of %d, loss %.4f",
                                       apps::name_of(method).c_str(), stage + 1, how.stages, loss);
                         progress.show(static_cast<int>(step), note);
                       });
  if (options.restarts > 0 && !result.run.stopped) {
    apps::Progress more(stderr, options.restarts);
    result.run = shorten_from_many(
        evaluator, scene, how, options.restarts, options.common.seed, std::move(result.run),
        [&](int restart, double loss) { more.show(restart, text("starts, best loss ", loss)); });
  }
  saved.save(result.run.stopped ? last_stage : how.stages, result.run);
  result.lens = lens_at(scene, result.run.x);
  result.spots = judge(scene, result.lens);
  return result;
}

std::vector<apps::Method> methods_of(const Options& options) {
  if (!options.compare) return {apps::method_named(options.method)};
  return {apps::Method::Lbfgs, apps::Method::NewtonCg, apps::Method::Adam};
}

// The result with the smallest spots by the reference tracer's many rays, among those that did not lose light.
const Result& best_of(const Scene& scene, const std::vector<Result>& results) {
  const double enough = 0.98 * judge(scene, scene.lens).mean_light;
  const auto price = [&](const Result& r) {
    return (r.spots.mean_light < enough ? 2 : 1) * r.spots.mean_rms;
  };
  return *std::min_element(results.begin(), results.end(),
                           [&](const Result& a, const Result& b) { return price(a) < price(b); });
}

double ms_per_gradient(const Scene& scene, Evaluator& evaluator) {
  const std::vector<double> x = start_of(scene);
  std::vector<double> gradient(x.size()), times;
  for (int n = 0; n < 31; ++n) {
    const auto start = std::chrono::steady_clock::now();
    evaluator.loss(x, gradient);
    times.push_back(
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
            .count());
  }
  std::nth_element(times.begin(), times.begin() + 15, times.end());
  return times[15];
}

void add_numbers(apps::Report& report, const Options& options, const Scene& scene,
                 const Result& after) {
  const SpotReport before = judge(scene, scene.lens);
  const auto um = [](double mm) { return 1e3 * mm; };
  const double f = paraxial(after.lens).focal_length();
  report.add_number("length, first vertex to image", after.lens.length(), "mm", scene.lens.length(),
                    text("at most ", scene.lens.length() * (1 - options.shorter_percent / 100)));
  report.add_number("mean spot, rms", um(after.spots.mean_rms), "um", um(before.mean_rms),
                    text("at most ", um(before.mean_rms)));
  report.add_number("light that arrives", 100 * after.spots.mean_light, "%",
                    100 * before.mean_light);
  report.add_number("focal length", f, "mm", scene.focal_length);
  report.add_number("F-number", f / 2 / scene.pupil_radius, "", scene.lens.f_number);
  report.own["shorter_percent"] = 100 * (1 - after.lens.length() / scene.lens.length());
  report.own["spot_before_um"] = um(before.mean_rms);
  report.own["spot_after_um"] = um(after.spots.mean_rms);
  report.own["light_before"] = before.mean_light;
  report.own["light_after"] = after.spots.mean_light;
  report.own["focal_length_before"] = scene.focal_length;
  report.own["focal_length_after"] = f;
  apps::Table fields{"fields",
                     {"degrees", "spot before, um", "after", "height before, mm", "after",
                      "light before, %", "after"},
                     {}};
  for (size_t n = 0; n < before.fields.size(); ++n) {
    const SpotField &a = before.fields[n], &b = after.spots.fields[n];
    fields.rows.push_back(
        {a.degrees, um(a.rms), um(b.rms), a.centroid, b.centroid, 100 * a.light, 100 * b.light});
  }
  report.add_table(fields);
}

void add_methods(apps::Report& report, const std::vector<Result>& results) {
  apps::Table table{"methods",
                    {"method", "steps", "gradients", "Hessian products", "seconds", "loss",
                     "mean spot, um", "length, mm"},
                    {}};
  apps::Plot plot{.title = "loss against run time; it rises where a stage asks for a shorter lens"};
  plot.y_label = "loss, 1 at the start";
  plot.log_x = plot.log_y = true;
  for (const Result& one : results) {
    const Run& run = one.run;
    const double seconds = run.series.empty() ? 0 : run.series.back().seconds;
    table.rows.push_back({run.method, run.steps, run.evaluations, run.products, seconds, run.loss,
                          1e3 * one.spots.mean_rms, one.lens.length()});
    plot.series.push_back(apps::loss_series(run.method, run.series));
  }
  report.add_table(table);
  report.add_plot(plot);
}

void add_prescription(apps::Report& report, const Lens& before, const Lens& after) {
  const auto radius = [](const Surface& s) {
    return s.curvature == 0 ? nlohmann::json("plane") : nlohmann::json(1 / s.curvature);
  };
  apps::Table table{"prescription, mm",
                    {"surface", "radius before", "after", "spacing before", "after", "n_d before",
                     "after", "conic after"},
                    {}};
  for (size_t k = 0; k < before.surfaces.size(); ++k) {
    const Surface &a = before.surfaces[k], &b = after.surfaces[k];
    table.rows.push_back({a.stop ? text(k + 1, ", stop") : text(k + 1), radius(a), radius(b),
                          a.spacing, b.spacing, a.index, b.index, b.conic});
  }
  report.add_table(table);
}

void write_results(const Options& options, const Scene& scene, Evaluator& evaluator,
                   const std::vector<Result>& results, apps::Report& report) {
  const auto& out = options.common.output;
  const Result& best = best_of(scene, results);
  Lens named = best.lens;
  named.name = scene.lens.name + ", made shorter";
  apps::write_file(out / "result.json", to_json(named).dump(1) + "\n");
  add_numbers(report, options, scene, best);
  report.add_number("a gradient", ms_per_gradient(scene, evaluator), "ms");
  add_methods(report, results);
  add_prescription(report, scene.lens, best.lens);
  for (const auto& [file, caption] : {std::pair{"lens_before.png", "before"},
                                      {"lens_after.png", "after"},
                                      {"spots.png", "spots"}})
    report.add_picture(file, caption);
  report.own["source"] = scene.lens.source;
  report.own["method"] = best.run.method;
  report.own["refused"] = best.run.refused;
  report.own["left_out"] = left_out(scene);
  report.own["ms_per_gradient"] = ms_per_gradient(scene, evaluator);
  report.own["compile_seconds"] = evaluator.compile_seconds();
  report.own["drawings"] = {
      drawing_of(scene, scene.lens, "before",
                 text(scene.lens.name, ": ", scene.lens.length(), " mm")),
      drawing_of(scene, best.lens, "after", text("made shorter: ", best.lens.length(), " mm"))};
  if (best.run.stopped)
    report.add_note("It was stopped before its end; this is the best until then.");
  report.write(best.run.steps, best.run.stopped);
  apps::draw_plot("draw_lens.py", out / "report.json", out);
}

void print_summary(const Scene& scene, const Result& best, const Options& options) {
  const SpotReport before = judge(scene, scene.lens);
  std::printf(
      "%s: length %.2f -> %.2f mm (%.1f %% shorter), mean spot %.1f -> %.1f um, by %s in %ld "
      "steps%s\n",
      scene.lens.name.c_str(), scene.lens.length(), best.lens.length(),
      100 * (1 - best.lens.length() / scene.lens.length()), 1e3 * before.mean_rms,
      1e3 * best.spots.mean_rms, best.run.method.c_str(), best.run.steps,
      best.run.stopped ? "; it was stopped" : "");
  std::printf("results in %s\n", options.common.output.c_str());
}

void print_explanation(const Scene& scene, const Evaluator& evaluator) {
  std::printf("%zu surfaces, %d rays of %zu fields and %zu wavelengths, %zu numbers move\n",
              scene.lens.surfaces.size(), scene.rings * scene.spokes, scene.fields_degrees.size(),
              scene.wavelengths.size(), scene.variables.size());
  for (const std::string& line : left_out(scene)) std::printf("left out: %s\n", line.c_str());
  std::printf("%s\n", evaluator.explain().c_str());
}

void run(const Options& options) {
  const apps::RunScope scope(options.common);
  const Lens lens = read_lens(options.common.input);
  if (options.common.check_gradients) {
    const auto rows = check_gradients(lens, scene_options(options));
    apps::report_tables("lens", options.common, {apps::gradient_table(rows)});
    return apps::require_gradients(rows);
  }
  apps::Report report("lens", options.common);
  const Scene scene = make_scene(lens, scene_options(options));
  if (options.common.check_stability)
    return apps::report_tables("lens", options.common,
                               {apps::stability_table(check_stability(scene))});
  Evaluator evaluator(scene, retrograde::Float(64));
  if (options.common.explain) print_explanation(scene, evaluator);
  std::vector<Result> results;
  for (const apps::Method method : methods_of(options)) {
    if (!results.empty() && apps::stop_requested()) break;
    results.push_back(run_method(options, scene, evaluator, method));
  }
  write_results(options, scene, evaluator, results, report);
  print_summary(scene, best_of(scene, results), options);
}

}  // namespace

}  // namespace lens

int main(int argc, char** argv) {
  return apps::run_app("lens", argc, argv, [](int c, char** v) {
    if (const auto options = lens::read_options(c, v)) lens::run(*options);
  });
}
