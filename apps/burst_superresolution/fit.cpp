// fit.cpp -- see fit.h.
#include "fit.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "common/adam.h"
#include "common/state.h"
#include "common/stop.h"
#include "common/timing.h"
#include "diagnostics/error.h"
#include "quality.h"

namespace burst {

using retrograde::text;

namespace {

using Clock = std::chrono::steady_clock;

constexpr const char* program = "burst_superresolution";
constexpr long looks = 60;  // comparisons with the truth, over the whole run
constexpr double explosion = 10;

// A description of what must be the same to resume a run. Weights chosen from the noise follow from these.
std::string problem_of(const Options& options, const Burst& burst) {
  return text(options.common.input.filename().string(), ", ", burst.frames(), " frames of ",
              burst.size.width, " x ", burst.size.height, ", noise ",
              burst.truth ? burst.truth->noise : 0, ", seed ", options.common.seed, ", lambda ",
              options.lambda ? text(*options.lambda) : std::string("by the noise"), ", ",
              options.colours == Colours::Rgb ? "rgb" : "opponent", ", optimizing ",
              options.moves.image ? "the image " : "",
              options.moves.homographies ? "the homographies" : "");
}

class Optimization {
 public:
  Optimization(const Options& options, const Burst& burst, const Prepared& prepared,
               Evaluator<float>& evaluator)
      : options_(options),
        burst_(burst),
        evaluator_(evaluator),
        problem_(problem_of(options, burst)),
        x_(joined(prepared.first, prepared.homographies)),
        gradient_(x_.size()),
        adam_({{evaluator.shape().image_elems(), image_rate},
               {evaluator.shape().motion_elems(), motion_rate}},
              {.schedule = apps::exponential_schedule(options.common.steps, last_rate),
               .explosion = explosion}) {
    if (options.common.resume) resume();
  }

  Fit run(const std::function<void(const Sample&)>& shown) {
    apps::SaveTimer timer;
    while (step()) {
      shown(fit_.series.back());
      if (timer.is_due()) save();
    }
    shown(fit_.series.back());
    save();
    fit_.refused = adam_.refused();
    fit_.stopped = apps::stop_requested();
    fit_.ms_per_step = 1e3 * apps::median(step_seconds_);
    return std::move(fit_);
  }

 private:
  std::filesystem::path file() const { return options_.common.output / "state.bin"; }

  bool is_over() const {
    const double limit = options_.common.seconds;
    return fit_.steps >= options_.common.steps || apps::stop_requested() ||
           (limit > 0 && fit_.seconds >= limit);
  }

  // Evaluates the loss at the current point and, unless the run is over, takes a step.
  bool step() {
    const auto start = Clock::now();
    const double loss = evaluator_.evaluate(x_, gradient_);
    if (loss < fit_.loss) {
      fit_.loss = loss;
      fit_.x = x_;
    }
    if (fit_.series.empty() && !std::isfinite(loss)) refuse_start(loss);
    const bool over = is_over();
    look(loss, over);
    if (over) return false;
    adam_.step(std::span<float>(x_), loss, std::span<const float>(gradient_));
    step_seconds_.push_back(apps::seconds_since(start) - looking_);
    fit_.seconds += step_seconds_.back();
    ++fit_.steps;
    return true;
  }

  // The time of this comparison does not count.
  void look(double loss, bool over) {
    const auto start = Clock::now();
    Sample sample{fit_.steps, fit_.seconds, loss};
    const long every = std::max(options_.common.steps / looks, 1L);
    if (burst_.truth && (fit_.steps % every == 0 || over)) {
      const Shape& shape = evaluator_.shape();
      Fit now;
      now.x = x_;
      sample.psnr_db = psnr_db(now.picture(shape), *burst_.truth, shape.size);
      if (shape.frames > 1) {
        sample.motion_error =
            motion_error(now.homographies(shape), burst_.truth->homographies, shape.size).mean;
      }
    }
    // The first sample of a resumed run repeats the last sample of the earlier one.
    if (!fit_.series.empty() && fit_.series.back().step == sample.step) fit_.series.pop_back();
    fit_.series.push_back(sample);
    looking_ = apps::seconds_since(start);
  }

  [[noreturn]] static void refuse_start(double loss) {
    retrograde::call_error("optimize from this start", "the loss must be finite there",
                           text("it is ", loss), "Give other frames");
  }

  void save() const {
    apps::State state{.program = program, .step = fit_.steps, .seconds = fit_.seconds};
    state.words["problem"] = problem_;
    state.put("x", x_);
    state.put("best", fit_.x);
    state.arrays["best_loss"] = {fit_.loss};
    std::vector<double> series;
    for (const Sample& s : fit_.series) {
      series.insert(series.end(),
                    {static_cast<double>(s.step), s.seconds, s.loss, s.psnr_db, s.motion_error});
    }
    state.arrays["series"] = series;
    adam_.save(state, "adam");
    apps::write_state(file(), state);
  }

  void resume() {
    const apps::State state = apps::read_state(file(), program);
    apps::require_same_problem(file(), state, problem_, "what");
    state.get("x", std::span<float>(x_));
    fit_.x.resize(x_.size());
    state.get("best", std::span<float>(fit_.x));
    fit_.loss = state.array("best_loss", 1)[0];
    const auto series = state.arrays.find("series");
    for (size_t n = 0; series != state.arrays.end() && n + 4 < series->second.size(); n += 5) {
      const double* s = series->second.data() + n;
      fit_.series.push_back({static_cast<long>(s[0]), s[1], s[2], s[3], s[4]});
    }
    adam_.restore(state, "adam");
    fit_.steps = state.step;
    fit_.seconds = state.seconds;
  }

  const Options& options_;
  const Burst& burst_;
  Evaluator<float>& evaluator_;
  const std::string problem_;
  std::vector<float> x_, gradient_;
  apps::Adam adam_;
  Fit fit_;
  std::vector<double> step_seconds_;
  double looking_ = 0;
};

}  // namespace

std::vector<Homography> Fit::homographies(const Shape& shape) const {
  std::vector<Homography> out(static_cast<size_t>(shape.frames));
  auto from = x.begin() + static_cast<long>(shape.image_elems());
  for (Homography& h : out) {
    std::copy_n(from, h.size(), h.begin());
    from += homography_params;
  }
  return out;
}

std::vector<float> joined(std::span<const float> picture,
                          std::span<const Homography> homographies) {
  std::vector<float> x(picture.begin(), picture.end());
  for (const Homography& h : homographies) x.insert(x.end(), h.begin(), h.end());
  return x;
}

Fit fit(const Options& options, const Burst& burst, const Prepared& prepared,
        Evaluator<float>& evaluator, const std::function<void(const Sample&)>& shown) {
  return Optimization(options, burst, prepared, evaluator).run(shown);
}

}  // namespace burst
