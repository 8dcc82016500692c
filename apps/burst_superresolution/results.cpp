// results.cpp -- see results.h.
#include "results.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "common/files.h"
#include "common/images.h"
#include "demosaic/photographs.h"
#include "diagnostics/error.h"
#include "pictures.h"
#include "quality.h"

namespace burst {

using retrograde::text;

namespace {

constexpr int enlarged_side = 80, enlarged_times = 4;

// A picture with its method's name, and the time when it was complete.
struct Method {
  const char* name;
  const char* file;
  std::span<const float> planes;
  double seconds;  // since the frames were read
};

std::vector<Method> methods_of(const Run& run) {
  return {{"AHD of the first frame", "ahd.png", run.prepared.first, run.prepared.seconds_to_first},
          {"bicubic average", "average.png", run.prepared.average, run.prepared.seconds_to_average},
          {"ours", "result.png", run.fit.picture(run.evaluator.shape()), run.total_seconds()}};
}

double psnr_of(const Run& run, std::span<const float> planes) {
  return psnr_db(planes, *run.burst.truth, run.burst.size);
}

void write_light(const Run& run, std::span<const float> planes) {
  if (run.burst.bits < 32) return;
  std::vector<float> light(planes.begin(), planes.end());
  for (float& value : light) value = demosaic::decoded(value);
  write_planes(run.options.common.output / "result.exr", light, run.burst.size, 32,
               run.burst.orientation);
}

void write_pictures(const Run& run, apps::Report& report) {
  const auto& out = run.options.common.output;
  const FrameSize& size = run.burst.size;
  std::vector<std::span<const float>> beside;
  std::string names;
  for (const Method& m : methods_of(run)) {
    write_planes(out / m.file, m.planes, size, run.burst.bits, run.burst.orientation);
    report.add_picture(m.file, m.name);
    beside.push_back(m.planes);
    names += (names.empty() ? "" : ", ") + std::string(m.name);
  }
  write_light(run, methods_of(run).back().planes);
  write_planes(out / "frame.png", coloured(run.burst.frame(0), size), size, run.burst.bits,
               run.burst.orientation);
  report.add_picture("frame.png", "the first frame");
  if (run.burst.truth) {
    write_planes(out / "truth.png", run.burst.truth->planes, size, run.burst.bits,
                 run.burst.orientation);
    report.add_picture("truth.png", "the truth");
    beside.push_back(run.burst.truth->planes);
    names += ", the truth";
  }
  const int side = std::min({enlarged_side, size.width, size.height});
  write_enlarged(out / "enlarged.png", beside, size,
                 busiest_square(run.prepared.average, size, side), side, enlarged_times,
                 run.burst.orientation);
  report.add_picture("enlarged.png", names);
}

void write_homographies(const Run& run) {
  nlohmann::json list = nlohmann::json::array();
  const auto found = run.fit.homographies(run.evaluator.shape());
  for (size_t n = 0; n < found.size(); ++n)
    list.push_back(
        {{"frame", run.burst.names[n]}, {"matrix", matrix_of(found[n], run.burst.size)}});
  const nlohmann::json all = {
      {"about", "from pixels of a frame to pixels of the picture, row by row"},
      {"homographies", list}};
  apps::write_file(run.options.common.output / "homographies.json", all.dump(1) + "\n");
}

void enter_quality(const Run& run, apps::Report& report) {
  const auto methods = methods_of(run);
  apps::Table table{"pictures", {"method", "PSNR [dB]", "seconds"}, {}};
  double best = 0;
  for (const Method& m : methods) {
    const double db = psnr_of(run, m.planes);
    table.rows.push_back({m.name, db, m.seconds});
    report.own["psnr_db"][m.name] = db;
    if (&m != &methods.back()) best = std::max(best, db);
  }
  const double own = psnr_of(run, methods.back().planes);
  report.add_number("PSNR", own, "dB", best, text("at least ", best + 2));
  report.own["gain_db"] = own - best;
  report.add_table(table);
}

void enter_motion(const Run& run, apps::Report& report) {
  const Shape& shape = run.evaluator.shape();
  const auto& truth = run.burst.truth->homographies;
  const MotionError before = motion_error(run.prepared.homographies, truth, shape.size);
  const MotionError after = motion_error(run.fit.homographies(shape), truth, shape.size);
  report.add_number("homography error, mean", after.mean, "pixels", before.mean);
  report.add_number("homography error, worst", after.worst, "pixels", before.worst);
  report.own["motion_error_px"] = {{"start", {{"mean", before.mean}, {"worst", before.worst}}},
                                   {"end", {{"mean", after.mean}, {"worst", after.worst}}}};
}

// A quality as a curve over time, starting when the optimization began.
apps::PlotSeries curve(const Run& run, const char* name, double Sample::*what) {
  apps::PlotSeries series{name, {}, {}};
  for (const Sample& s : run.fit.series) {
    if (std::isnan(s.*what)) continue;
    series.x.push_back(run.total_seconds() - run.fit.seconds + s.seconds);
    series.y.push_back(s.*what);
  }
  return series;
}

void add_plots(const Run& run, apps::Report& report) {
  const std::string since = "run time since the frames were read [s]";
  apps::Plot loss{.title = "loss against run time", .x_label = since, .log_y = true};
  loss.series = {curve(run, "loss", &Sample::loss)};
  report.add_plot(loss);
  if (!run.burst.truth) return;
  apps::Plot quality{.file = "psnr_vs_time.png",
                     .title = "quality against run time",
                     .x_label = since,
                     .y_label = "PSNR [dB]"};
  quality.series = {curve(run, "ours", &Sample::psnr_db)};
  for (const Method& m : methods_of(run)) {
    if (m.planes.data() != run.fit.x.data())
      quality.series.push_back({m.name, {m.seconds}, {psnr_of(run, m.planes)}, {m.name}});
  }
  report.add_plot(quality);
  if (run.evaluator.shape().frames < 2) return;
  apps::Plot motion{.file = "motion_vs_time.png",
                    .title = "homographies against run time",
                    .x_label = since,
                    .y_label = "mean error [pixels]",
                    .log_y = true};
  motion.series = {curve(run, "homographies", &Sample::motion_error)};
  report.add_plot(motion);
}

void enter_run(const Run& run, apps::Report& report) {
  const Shape& shape = run.evaluator.shape();
  report.add_number("from frames to picture", run.total_seconds(), "s");
  report.add_number("a step", run.fit.ms_per_step, "ms");
  report.own["frames"] = run.burst.names;
  report.own["width"] = shape.size.width;
  report.own["height"] = shape.size.height;
  report.own["noise"] = run.prepared.noise;
  for (const ColourAxis& axis : run.prepared.smoothness)
    report.own["lambda"].push_back(axis.weight);
  report.own["loss"] = run.fit.loss;
  report.own["ms_per_step"] = run.fit.ms_per_step;
  report.own["refused_steps"] = run.fit.refused;
  report.own["seconds"] = {{"prepare", run.prepared.seconds},
                           {"compile", run.compile_seconds},
                           {"optimize", run.fit.seconds},
                           {"total", run.total_seconds()}};
  report.own["left_out"] = left_out(shape, run.prepared.smoothness, run.options.moves);
  for (const std::string& note : run.burst.notes) report.add_note(note);
  if (run.fit.stopped)
    report.add_note("It was stopped before its end; this is the best until then.");
}

std::string weights_of(const Smoothness& smoothness) {
  std::string weights;
  for (const ColourAxis& axis : smoothness) {
    char weight[32];
    std::snprintf(weight, sizeof weight, "%.4f", axis.weight);
    weights += (weights.empty() ? "" : ", ") + std::string(weight);
  }
  return weights.empty() ? "none" : weights;
}

}  // namespace

void write_results(const Run& run, apps::Report& report) {
  write_pictures(run, report);
  write_homographies(run);
  if (run.burst.truth) enter_quality(run, report);
  if (run.burst.truth && run.burst.frames() > 1) enter_motion(run, report);
  enter_run(run, report);
  add_plots(run, report);
  report.write(run.fit.steps, run.fit.stopped);
}

void print_summary(const Run& run) {
  for (const std::string& note : run.burst.notes) std::printf("%s\n", note.c_str());
  std::printf("%d frames of %d x %d, noise %.4f, smoothness %s: loss %.5g after %ld steps%s\n",
              run.burst.frames(), run.burst.size.width, run.burst.size.height, run.prepared.noise,
              weights_of(run.prepared.smoothness).c_str(), run.fit.loss, run.fit.steps,
              run.fit.stopped ? "; it was stopped" : "");
  for (const Method& m : methods_of(run)) {
    if (run.burst.truth)
      std::printf("%s: %.2f dB after %.1f s\n", m.name, psnr_of(run, m.planes), m.seconds);
  }
  std::printf("%.1f ms a step, %.1f s from frames to picture; results in %s\n", run.fit.ms_per_step,
              run.total_seconds(), run.options.common.output.c_str());
}

}  // namespace burst
