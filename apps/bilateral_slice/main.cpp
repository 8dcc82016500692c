// main.cpp -- bilateral_slice: learn a photographic look. See README.md beside this file.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <string>
#include <vector>

#include "common/files.h"
#include "common/images.h"
#include "common/plots.h"
#include "common/process.h"
#include "common/progress.h"
#include "common/run_app.h"
#include "diagnostics/error.h"
#include "fit.h"
#include "gradient_check.h"
#include "options.h"
#include "report.h"
#include "tone_edit.h"

namespace bilateral_slice {

using retrograde::text;

namespace {

using Planes = std::vector<float>;

// Three colour planes, and a fourth of ones when `homogeneous`.
Planes to_planes(const apps::Image& image, bool homogeneous) {
  const long pixels = static_cast<long>(image.width) * image.height;
  Planes planes((homogeneous ? 4 : 3) * pixels, 1.0f);
  for (int c = 0; c < 3; ++c) {
    for (long p = 0; p < pixels; ++p) planes[c * pixels + p] = image.pixels[3 * p + c];
  }
  return planes;
}

void write_planes(const std::filesystem::path& path, const Shape& shape, const Planes& planes,
                  int bits) {
  apps::Image image{shape.width, shape.height, bits, {}};
  image.pixels.resize(image.elems());
  for (int c = 0; c < 3; ++c) {
    for (long p = 0; p < shape.pixels(); ++p) {
      image.pixels[3 * p + c] = planes[c * shape.pixels() + p];
    }
  }
  apps::write_png(path, image);
}

double mean_squared_difference(const Planes& a, const Planes& b, long samples) {
  double sum = 0;
  for (long n = 0; n < samples; ++n) {
    const double d = static_cast<double>(a[n]) - b[n];
    sum += d * d;
  }
  return sum / static_cast<double>(samples);
}

// The photo, and what it shall look like.
struct Pair {
  Shape shape;
  int bits = 8;
  Planes photo, target;
};

void require_same_size(const Options& options, const apps::Image& a, const apps::Image& b) {
  if (a.width == b.width && a.height == b.height) return;
  retrograde::call_error(
      text("learn how ", retrograde::quoted(options.input.string()), " becomes ",
           retrograde::quoted(options.target.string())),
      "input and target must have the same size",
      text("they have ", a.width, " x ", a.height, " and ", b.width, " x ", b.height, " pixels"),
      "Resize or crop one of them");
}

apps::Image read_photo(const std::filesystem::path& path) {
  apps::Image image = apps::read_image(path);
  if (image.width < 4 || image.height < 4) {
    retrograde::call_error(
        text("learn a look from ", retrograde::quoted(path.string())),
        "a grid is interpolated along both axes: a photo has at least 4 x 4 pixels",
        text("it has ", image.width, " x ", image.height), "Give a larger photo");
  }
  return image;
}

Pair read_pair(const Options& options) {
  Pair pair;
  const apps::Image input = read_photo(options.input);
  pair.shape = {.width = input.width, .height = input.height};
  pair.bits = input.bits;
  if (options.target.empty()) {
    pair.photo = to_planes(input, true);
    pair.target.resize(3 * pair.shape.pixels());
    tone_edit(pair.shape, pair.photo.data(), pair.target.data());
    return pair;
  }
  const apps::Image target = apps::read_image(options.target);
  require_same_size(options, input, target);
  pair.bits = std::max(input.bits, target.bits);
  pair.photo = to_planes(input, true);
  pair.target = to_planes(target, false);
  return pair;
}

Fit fit_with_progress(const Options& options, Pair& pair) {
  apps::Progress progress(stderr, options.steps);
  return fit(pair.shape, pair.photo, pair.target,
             {options.steps, options.threads, options.halide_seconds}, [&](int step, double loss) {
               char note[32];
               std::snprintf(note, sizeof note, "%.2f dB", psnr_db(loss));
               progress.show(step, note);
             });
}

void write_results(const Options& options, const Pair& pair, const Fit& fit, const Report& report) {
  write_planes(options.output / "input.png", pair.shape, pair.photo, pair.bits);
  write_planes(options.output / "target.png", pair.shape, pair.target, pair.bits);
  write_planes(options.output / "result.png", pair.shape, fit.result, pair.bits);
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
  std::printf("\nresults in %s\n", options.output.c_str());
  if (!fit.why_no_peer.empty()) std::fprintf(stderr, "%s\n", fit.why_no_peer.c_str());
}

// --check-gradients
void check_gradients(const Options& options, const Pair& pair) {
  const retrograde::GradientReport report =
      check_gradients_in_full(pair.shape, pair.photo.data(), pair.target.data());
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
}

void run(const Options& options) {
  apps::require_writable_folder(options.output);
  const apps::ThreadLimit threads(options.threads);
  const auto start = std::chrono::steady_clock::now();
  Pair pair = read_pair(options);
  if (options.check_gradients) return check_gradients(options, pair);
  Report report;
  report.shape = pair.shape;
  report.threads = options.threads;
  report.psnr_initial_db =
      psnr_db(mean_squared_difference(pair.photo, pair.target, 3 * pair.shape.pixels()));
  report.gradient_check = check_gradient(pair.shape, pair.photo.data(), pair.target.data());
  const Fit fit = fit_with_progress(options, pair);
  report.psnr_final_db =
      psnr_db(mean_squared_difference(fit.result, pair.target, 3 * pair.shape.pixels()));
  report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
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
