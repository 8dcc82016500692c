// learn.cpp -- see learn.h.
#include "learn.h"

#include <utility>

#include "common/learning_run.h"
#include "common/stop.h"
#include "diagnostics/error.h"
#include "training.h"

namespace deconvolution {

namespace {

Weights start_of(const Options& options) {
  return options.weights.empty() ? learning_start(options.shape, options.stages)
                                 : read_weights(options.weights);
}

// Learned weights use mixtures; those of the original method use thresholds, which have a gradient too.
Trainer::Options trainer_options(const Options& options) {
  return {.common = options.common, .from_weights = !options.weights.empty()};
}

// The stages, and their results on the held-out photographs.
class StagesLearner : public apps::Learner {
 public:
  StagesLearner(const Options& options, const demosaic::Dataset& dataset, const Gallery& held_out)
      : options_(options),
        held_out_(held_out),
        trainer_(start_of(options), dataset.train, trainer_options(options)),
        method_({"learned", trainer_.weights()}, held_out.extent(), options.common.threads,
                {options.iterations, usual_accuracy.tolerance}) {}

  double step() override { return trainer_.step(); }

  double look(long steps) override {
    method_.use({retrograde::text("learned, ", steps, " steps"), trainer_.weights()});
    if (auto measured = held_out_.measure(method_)) measured_ = *std::move(measured);
    return measured_.mean_db;
  }

  void save(apps::State& state) override {
    trainer_.save(state);
    write_weights(options_.common.output / "weights.json", trainer_.weights(),
                  retrograde::text(state.step, " steps, seed ", options_.common.seed));
  }

  void restore(const apps::State& state) override { trainer_.restore(state); }

  const Trainer& trainer() const { return trainer_; }
  // From the last evaluation that was not stopped.
  const Measured& measured() const { return measured_; }

 private:
  const Options& options_;
  const Gallery& held_out_;
  Trainer trainer_;
  Deconvolver method_;
  Measured measured_;
};

}  // namespace

Learned learn(const Options& options, const demosaic::Dataset& dataset, const Gallery& held_out,
              apps::Report& report) {
  apps::LearningRun run("deconvolution", options.common, {.looks = 20, .least_between = 25});
  StagesLearner learner(options, dataset, held_out);
  run.learn(learner);
  const Trainer& trainer = learner.trainer();
  run.enter(report,
            {.loss_title = retrograde::text("learning ", trainer.weights().stages, " stages"),
             .loss_label = "loss of a batch, smoothed [dB]",
             .quality_title = "held-out photographs while stages are learned",
             .quality_label = "PSNR [dB]"});
  report.own["refused_steps"] = trainer.adam().refused();
  report.own["compile_seconds"] = trainer.compile_seconds();
  return {trainer.weights(), learner.measured(), run.steps(), apps::stop_requested()};
}

}  // namespace deconvolution
