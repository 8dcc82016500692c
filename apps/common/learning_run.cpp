// learning_run.cpp -- see learning_run.h.
#include "common/learning_run.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <utility>

#include "common/progress.h"
#include "common/stop.h"
#include "common/timing.h"

namespace apps {

namespace {

constexpr const char* state_file = "state.bin";
constexpr double kept_of_loss =
    0.98;  // weight of the previous value in the smoothed loss, per step

}  // namespace

LearningRun::LearningRun(std::string program, const CommonOptions& options, const Plan& plan)
    : program_(std::move(program)), options_(options), plan_(plan) {
  if (options.resume) state_ = read_state(options.output / state_file, program_);
}

void LearningRun::learn(Learner& learner) {
  if (state_) {
    learner.restore(*state_);
    steps_ = static_cast<long>(state_->step);
    seconds_ = state_->seconds;
  }
  Progress progress(stderr, static_cast<int>(options_.steps));
  const long every = std::max(options_.steps / plan_.looks, plan_.least_between);
  look(learner);
  long looked_at = steps_;
  while (!is_over()) {
    step(learner);
    if (steps_ % every == 0) {
      look(learner);
      save(learner);
      looked_at = steps_;
    }
    char note[48];
    std::snprintf(note, sizeof note, "held out %.2f dB", quality_.y.back());
    progress.show(static_cast<int>(steps_), note);
  }
  save(learner);
  if (looked_at != steps_) look(learner);
}

bool LearningRun::is_over() const {
  return steps_ >= options_.steps || stop_requested() ||
         (options_.seconds > 0 && seconds_ >= options_.seconds);
}

void LearningRun::step(Learner& learner) {
  const auto start = std::chrono::steady_clock::now();
  const double loss = learner.step();
  step_seconds_.push_back(seconds_since(start));
  seconds_ += step_seconds_.back();
  ++steps_;
  const double smooth =
      loss_.y.empty() ? loss : kept_of_loss * loss_.y.back() + (1 - kept_of_loss) * loss;
  loss_.x.push_back(seconds_);
  loss_.y.push_back(smooth);
}

// A stopped run evaluates and prints nothing more, so that the user does not wait.
void LearningRun::look(Learner& learner) {
  if (stop_requested()) return;
  const double quality = learner.look(steps_);
  if (stop_requested()) return;
  quality_.x.push_back(seconds_);
  quality_.y.push_back(quality);
}

void LearningRun::save(Learner& learner) const {
  State state{.program = program_, .step = steps_, .seconds = seconds_};
  learner.save(state);
  write_state(options_.output / state_file, state);
}

void LearningRun::enter(Report& report, const Titles& titles) const {
  report.add_plot({.title = titles.loss_title,
                   .y_label = titles.loss_label,
                   .log_y = titles.log_loss,
                   .series = {loss_}});
  report.add_plot({.file = "psnr_vs_time.png",
                   .title = titles.quality_title,
                   .y_label = titles.quality_label,
                   .series = {quality_}});
  report.own["ms_per_step"] = ms_per_step();
}

double LearningRun::ms_per_step() const { return 1e3 * median(step_seconds_); }

}  // namespace apps
