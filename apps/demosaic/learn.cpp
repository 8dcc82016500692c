#include "learn.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <optional>

#include "common/progress.h"
#include "common/stop.h"
#include "common/timing.h"
#include "training.h"

namespace demosaic {

namespace {

constexpr const char* program = "demosaic";
constexpr int looks = 40;  // at the held-out photographs, over the whole run

// Read before anything is compiled, so that a bad one is told at once.
std::optional<apps::State> state_of(const Options& options) {
  if (!options.common.resume) return std::nullopt;
  return apps::read_state(options.common.output / "state.bin", program);
}

// One learning run, its clock and its curves.
class Run {
 public:
  Run(const Options& options, const Dataset& dataset, Gallery& held_out)
      : options_(options),
        held_out_(held_out),
        state_(state_of(options)),
        trainer_(Weights(options.shape), dataset.train,
                 {.steps = options.common.steps,
                  .threads = options.common.threads,
                  .seed = options.common.seed,
                  .groups = options.common.optimize}),
        method_(Demosaicker::relaxed(trainer_.weights(), options.common.threads)) {
    if (state_) resume();
  }

  Learned run() {
    apps::Progress progress(stderr, static_cast<int>(options_.common.steps));
    const long every = std::max(options_.common.steps / looks, 1L);
    look();
    while (!is_over()) {
      step();
      if (steps_ % every == 0) look();
      char note[48];
      std::snprintf(note, sizeof note, "held out %.2f dB", quality_.y.back());
      progress.show(static_cast<int>(steps_), note);
    }
    if (quality_.x.back() != seconds_) look();
    save();
    return {trainer_.weights(), steps_, seconds_, 1e3 * apps::median(step_seconds_),
            apps::stop_requested()};
  }

  void enter(apps::Report& report) const {
    report.add_plot({.title = "learning " + method_.name(),
                     .y_label = "mean squared error of a batch, weighed",
                     .log_y = true,
                     .series = {loss_}});
    report.add_plot({.file = "psnr_vs_time.png",
                     .title = "held-out photographs while " + method_.name() + " is learned",
                     .y_label = "PSNR, sRGB [dB]",
                     .series = {quality_}});
    report.own["refused_steps"] = trainer_.adam().refused();
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
    ++steps_;
    smooth_ = smooth_ > 0 ? 0.98 * smooth_ + 0.02 * loss : loss;
    loss_.x.push_back(seconds_);
    loss_.y.push_back(smooth_);
  }

  // Its time does not count as learning.
  void look() {
    method_.use(trainer_.weights());
    quality_.x.push_back(seconds_);
    quality_.y.push_back(held_out_.quality_of(method_).mean.encoded_db);
  }

  void save() {
    apps::State state{.program = program, .step = steps_, .seconds = seconds_};
    trainer_.save(state);
    apps::write_state(options_.common.output / "state.bin", state);
    Weights weights = trainer_.weights();
    write_weights(options_.common.output / "weights.json", weights,
                  retrograde::text(steps_, " steps, seed ", options_.common.seed));
  }

  void resume() {
    trainer_.restore(*state_);
    steps_ = state_->step;
    seconds_ = state_->seconds;
  }

  const Options& options_;
  Gallery& held_out_;
  std::optional<apps::State> state_;  // to go on from
  Trainer trainer_;
  Demosaicker method_;
  long steps_ = 0;
  double seconds_ = 0, smooth_ = 0;
  std::vector<double> step_seconds_;
  apps::PlotSeries loss_{"training batches, smoothed", {}, {}}, quality_{"held out", {}, {}};
};

}  // namespace

Learned learn(const Options& options, const Dataset& dataset, Gallery& held_out,
              apps::Report& report) {
  Run run(options, dataset, held_out);
  Learned learned = run.run();
  run.enter(report);
  return learned;
}

apps::Table time_steps(const Options& options, const Dataset& dataset) {
  constexpr int timed = 15;
  apps::Table table{"a step of learning", {"groups", "stages of the gradient", "ms"}, {}};
  std::vector<std::vector<std::string>> choices{group_names};
  for (const std::string& group : group_names) choices.push_back({group});
  for (const auto& groups : choices) {
    Trainer trainer(Weights(options.shape), dataset.train,
                    {.threads = options.common.threads, .groups = groups});
    std::vector<double> seconds;
    for (int step = 0; step < timed; ++step) {
      const auto start = std::chrono::steady_clock::now();
      trainer.step();
      seconds.push_back(apps::seconds_since(start));
    }
    table.rows.push_back({groups.size() > 1 ? std::string("all") : groups[0], trainer.stages(),
                          1e3 * apps::median(seconds)});
  }
  return table;
}

}  // namespace demosaic
