// learn.cpp -- see learn.h.
#include "learn.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <optional>

#include "common/progress.h"
#include "common/stop.h"
#include "common/timing.h"
#include "diagnostics/error.h"
#include "training.h"

namespace deconvolution {

namespace {

constexpr const char* program = "deconvolution";
// At the held-out photographs, over the whole run; at each the state is saved, too.
constexpr long looks = 20, least_between = 25;

// Read before anything is compiled, so that a bad one is told at once.
std::optional<apps::State> state_of(const Options& options) {
  if (!options.common.resume) return std::nullopt;
  return apps::read_state(options.common.output / "state.bin", program);
}

Weights start_of(const Options& options) {
  return options.weights.empty() ? learning_start(options.shape, options.stages)
                                 : read_weights(options.weights);
}

// Learned weights are of mixtures; those of the original method have thresholds, which have a gradient, too.
Trainer::Options trainer_options(const Options& options) {
  return {.steps = options.common.steps,
          .threads = options.common.threads,
          .seed = options.common.seed,
          .groups = options.common.optimize,
          .from_weights = !options.weights.empty()};
}

// One learning run, its clock and its curves.
class Run {
 public:
  Run(const Options& options, const demosaic::Dataset& dataset, const Gallery& held_out)
      : options_(options),
        held_out_(held_out),
        state_(state_of(options)),
        trainer_(start_of(options), dataset.train, trainer_options(options)),
        method_({"learned", trainer_.weights()}, held_out.extent(), options.common.threads,
                {options.iterations, usual_accuracy.tolerance}) {
    if (state_) resume();
  }

  Learned run() {
    apps::Progress progress(stderr, static_cast<int>(options_.common.steps));
    const long every = std::max(options_.common.steps / looks, least_between);
    look();
    while (!is_over()) {
      step();
      if (steps_ % every == 0) {
        look();
        save();
      }
      char note[48];
      std::snprintf(note, sizeof note, "held out %.2f dB", quality_.y.back());
      progress.show(static_cast<int>(steps_), note);
    }
    Measured measured = look();
    save();
    return {trainer_.weights(), std::move(measured), steps_, apps::stop_requested()};
  }

  void enter(apps::Report& report) const {
    report.add_plot({.title = "learning " + retrograde::text(trainer_.weights().stages) + " stages",
                     .y_label = "loss of a batch, smoothed [dB]",
                     .series = {loss_}});
    report.add_plot({.file = "psnr_vs_time.png",
                     .title = "held-out photographs while stages are learned",
                     .y_label = "PSNR [dB]",
                     .series = {quality_}});
    report.own["refused_steps"] = trainer_.adam().refused();
    report.own["ms_per_step"] = 1e3 * apps::median(step_seconds_);
    report.own["compile_seconds"] = trainer_.compile_seconds();
  }

 private:
  bool is_over() const {
    const double limit = options_.common.seconds;
    return steps_ >= options_.common.steps || apps::stop_requested() ||
           (limit > 0 && seconds_ >= limit);
  }

  void step() {
    const auto start = std::chrono::steady_clock::now();
    const double loss = trainer_.step();
    step_seconds_.push_back(apps::seconds_since(start));
    seconds_ += step_seconds_.back();
    smooth_ = steps_ > 0 ? 0.98 * smooth_ + 0.02 * loss : loss;
    ++steps_;
    loss_.x.push_back(seconds_);
    loss_.y.push_back(smooth_);
  }

  // Its time does not count as learning.
  Measured look() {
    method_.use({retrograde::text("learned, ", steps_, " steps"), trainer_.weights()});
    Measured measured = held_out_.measure(method_);
    quality_.x.push_back(seconds_);
    quality_.y.push_back(measured.mean_db);
    return measured;
  }

  void save() {
    apps::State state{.program = program, .step = steps_, .seconds = seconds_};
    trainer_.save(state);
    apps::write_state(options_.common.output / "state.bin", state);
    write_weights(options_.common.output / "weights.json", trainer_.weights(),
                  retrograde::text(steps_, " steps, seed ", options_.common.seed));
  }

  void resume() {
    trainer_.restore(*state_);
    steps_ = static_cast<long>(state_->step);
    seconds_ = state_->seconds;
  }

  const Options& options_;
  const Gallery& held_out_;
  std::optional<apps::State> state_;  // to go on from
  Trainer trainer_;
  Deconvolver method_;
  long steps_ = 0;
  double seconds_ = 0, smooth_ = 0;
  std::vector<double> step_seconds_;
  apps::PlotSeries loss_{"training batches, smoothed", {}, {}}, quality_{"held out", {}, {}};
};

}  // namespace

Learned learn(const Options& options, const demosaic::Dataset& dataset, const Gallery& held_out,
              apps::Report& report) {
  Run run(options, dataset, held_out);
  Learned learned = run.run();
  run.enter(report);
  return learned;
}

}  // namespace deconvolution
