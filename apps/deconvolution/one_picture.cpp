// one_picture.cpp -- see one_picture.h.
#include "one_picture.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <optional>

#include "common/images.h"
#include "common/progress.h"
#include "common/stop.h"
#include "common/timing.h"
#include "diagnostics/error.h"
#include "simulation.h"

namespace deconvolution {

using retrograde::text;

namespace {

constexpr int channels = 3;
constexpr size_t watched = 1;  // green, whose quality is plotted

// The input as problems to deconvolve, one per channel.
struct Picture {
  std::vector<Simulated> channels;  // without a truth if it came blurred
  int bits = 8;
  bool has_truth = true;
  const Extent& extent() const { return channels.front().problem.extent; }
};

void require_size(const Options& options, const demosaic::Photograph& photograph, int least) {
  if (photograph.width >= least && photograph.height >= least) return;
  retrograde::call_error(
      text("deconvolve ", retrograde::quoted(options.common.input.string())),
      text("a picture has ", least, " pixels along each side for this point-spread function"),
      text("it has ", photograph.width, " x ", photograph.height),
      "Give a larger picture or a smaller function");
}

Picture read_picture(const Options& options) {
  constexpr int least = 16;
  const Psf psf = psf_of(options.psf);
  const auto photograph = demosaic::read_photograph(options.common.input);
  require_size(options, photograph, least + (options.blurred ? 0 : psf.size - 1));
  Picture picture{{}, photograph.bits, !options.blurred};
  Random random(options.common.seed);
  for (int c = 0; c < channels; ++c) {
    const Plane plane = channel_of(photograph, c);
    Simulated& to = picture.channels.emplace_back();
    if (picture.has_truth) {
      to.add(plane, psf, options.noise, random);
    } else {
      to.problem = {{plane.width, plane.height, 1, psf.size},
                    plane.samples,
                    psf.samples,
                    {static_cast<float>(options.noise)}};
    }
  }
  return picture;
}

using Planes = std::vector<std::vector<float>>;

double psnr_of(const Picture& picture, const Planes& planes) {
  std::vector<float> image, truth;
  for (size_t c = 0; c < channels; ++c) {
    image.insert(image.end(), planes[c].begin(), planes[c].end());
    truth.insert(truth.end(), picture.channels[c].truth.begin(), picture.channels[c].truth.end());
  }
  return psnr_db(image, truth);
}

apps::Image image_of(const Picture& picture, const Planes& planes, bool as_light) {
  const Extent& e = picture.extent();
  apps::Image image{e.width, e.height, picture.bits, {}};
  for (size_t k = 0; k < planes.front().size(); ++k) {
    for (const auto& plane : planes) {
      image.pixels.push_back(as_light ? demosaic::decoded(plane[k]) : plane[k]);
    }
  }
  return image;
}

void write_psf(const Options& options) {
  const Psf psf = psf_of(options.psf);
  const float brightest = *std::max_element(psf.samples.begin(), psf.samples.end());
  apps::Image image{psf.size, psf.size, 8, {}};
  for (const float value : psf.samples)
    image.pixels.insert(image.pixels.end(), 3, value / brightest);
  apps::write_image(options.common.output / "psf.png", image);
}

// Runs the methods on one picture, with their times and curves.
class Run {
 public:
  Run(const Options& options, const std::vector<Method>& methods, apps::Report& report,
      const Heard& heard)
      : options_(options),
        methods_(methods),
        report_(report),
        heard_(heard),
        picture_(read_picture(options)) {}

  long run() {
    show_blurred();
    int total = 0;
    for (const Method& m : methods_) total += channels * iterations_of(m);
    apps::Progress progress(stderr, total);
    bool whole = true;
    for (size_t m = 0; m < methods_.size() && whole; ++m)
      whole = !is_over() && deconvolve(methods_[m], progress);
    if (!whole) keep_best();
    enter();
    return done_;
  }

 private:
  int iterations_of(const Method& m) const { return options_.iterations * m.weights.stages; }
  bool is_over() const {
    const double limit = options_.common.seconds;
    return apps::stop_requested() || (limit > 0 && apps::seconds_since(start_) >= limit);
  }

  void show_blurred() {
    Planes truth;
    for (const Simulated& s : picture_.channels) {
      best_.push_back(s.problem.blurred);
      truth.push_back(s.truth);
    }
    write("blurred.png", best_);
    write_psf(options_);
    report_.add_picture("psf.png", "the point-spread function, enlarged by your viewer");
    if (!picture_.has_truth) return report_.add_picture("blurred.png", "the input");
    blurred_db_ = psnr_of(picture_, best_);
    write("truth.png", truth);
    report_.add_picture("truth.png", "the photograph");
    show("blurred.png", "blurred", blurred_db_);
    report_.own["picture"]["blurred"] = blurred_db_;
  }

  // Methods of one shape are compiled once.
  Deconvolver& deconvolver_of(const Method& method) {
    if (deconvolver_ && deconvolver_->shape() == method.weights.shape) {
      deconvolver_->use(method);
    } else {
      deconvolver_.emplace(method, picture_.extent(), options_.common.threads,
                           Accuracy{options_.iterations, usual_accuracy.tolerance});
    }
    return *deconvolver_;
  }

  // Returns false if it was stopped.
  bool deconvolve(const Method& method, apps::Progress& progress) {
    Deconvolver& deconvolver = deconvolver_of(method);
    apps::PlotSeries series{method.name, {}, {}};
    const auto begin = std::chrono::steady_clock::now();
    bool whole = true;
    for (size_t c = 0; c < channels && whole; ++c)
      whole = !is_over() && deconvolve_channel(method, c, deconvolver, series, progress);
    if (whole) keep(method, apps::seconds_since(begin));
    if (!series.x.empty()) series_.push_back(series);
    return whole;
  }

  bool deconvolve_channel(const Method& method, size_t c, Deconvolver& deconvolver,
                          apps::PlotSeries& series, apps::Progress& progress) {
    const Simulated& channel = picture_.channels[c];
    const long before = done_;
    const auto begin = std::chrono::steady_clock::now();
    std::vector<float> plane = deconvolver.run(channel.problem, [&](int count, const auto& images) {
      done_ = before + count;
      progress.show(static_cast<int>(done_), method.name);
      if (c == watched && picture_.has_truth) {
        const std::vector<float> now(images.begin(), images.end());
        series.x.push_back(apps::seconds_since(begin));
        series.y.push_back(psnr_db(cropped(now, channel.problem.extent), channel.truth));
      }
      if (heard_) heard_(method.name, c, count);
      return !is_over();
    });
    const bool whole = !deconvolver.stopped();
    if (whole) done_ = before + iterations_of(method);
    keep_if_better(method, c, std::move(plane), whole);
    return whole;
  }

  // The first stages of a method are worse than the previous method's final result, but better than nothing.
  void keep_if_better(const Method& method, size_t c, std::vector<float> plane, bool whole) {
    if (!whole && is_deconvolved_[c]) return;
    best_[c] = std::move(plane);
    best_by_[c] = whole ? method.name : text("unfinished by ", method.name);
    is_deconvolved_[c] = is_deconvolved_[c] || whole;
  }

  void keep(const Method& method, double seconds) {
    report_.own["seconds"][method.name] = seconds;
    if (&method == &methods_.back()) return keep_result(method.name);
    keep_as(method.name + ".png", method.name);
  }

  void keep_best() {
    report_.add_note(text("ended early: of result.png, red is ", best_by_[0], ", green ",
                          best_by_[1], ", blue ", best_by_[2]));
    keep_result("best so far");
  }

  void keep_result(const std::string& name) {
    const double db = keep_as("result.png", name);
    if (picture_.bits == 32)
      apps::write_image(options_.common.output / "result.exr", image_of(picture_, best_, true));
    if (picture_.has_truth) report_.add_number("PSNR of the picture", db, "dB", blurred_db_);
  }

  // Returns the PSNR of the best result so far; 0 without a truth.
  double keep_as(const std::string& file, const std::string& name) {
    write(file, best_);
    if (!picture_.has_truth) {
      report_.add_picture(file, name);
      return 0;
    }
    const double db = psnr_of(picture_, best_);
    report_.own["picture"][name] = db;
    show(file, name, db);
    return db;
  }

  void enter() {
    report_.own["width"] = picture_.extent().width;
    report_.own["height"] = picture_.extent().height;
    if (series_.empty()) return;
    report_.add_plot({.title = "green channel, as conjugate gradients go on",
                      .y_label = "PSNR [dB]",
                      .series = series_});
  }

  void show(const std::string& file, const std::string& name, double db) {
    report_.add_picture(file, text(name, ", ", std::round(100 * db) / 100, " dB"));
  }
  void write(const std::string& file, const Planes& planes) const {
    apps::Image image = image_of(picture_, planes, false);
    apps::write_image(options_.common.output / file, image);
  }

  const Options& options_;
  const std::vector<Method>& methods_;
  apps::Report& report_;
  const Heard& heard_;
  Picture picture_;
  // The best result so far of each channel, the method that made it, and whether that method was complete.
  Planes best_;
  std::array<std::string, channels> best_by_{"blurred", "blurred", "blurred"};
  std::array<bool, channels> is_deconvolved_{};
  std::optional<Deconvolver> deconvolver_;
  std::vector<apps::PlotSeries> series_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  long done_ = 0;
  double blurred_db_ = 0;
};

}  // namespace

long deconvolve_input(const Options& options, const std::vector<Method>& methods,
                      apps::Report& report, const Heard& heard) {
  return Run(options, methods, report, heard).run();
}

}  // namespace deconvolution
