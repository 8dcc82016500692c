#include "learn.h"

#include <chrono>

#include "common/learning_run.h"
#include "common/stop.h"
#include "common/timing.h"
#include "training.h"

namespace demosaic {

namespace {

// The weights, and their quality on the held-out photographs.
class FilterLearner : public apps::Learner {
 public:
  FilterLearner(const Options& options, const Dataset& dataset, Gallery& held_out)
      : options_(options),
        held_out_(held_out),
        trainer_(Weights(options.shape), dataset.train, {.common = options.common}),
        method_(Demosaicker::relaxed(trainer_.weights(), options.common.threads)) {}

  double step() override { return trainer_.step(); }

  double look(long) override {
    method_.use(trainer_.weights());
    return held_out_.quality_of(method_).mean.encoded_db;
  }

  void save(apps::State& state) override {
    trainer_.save(state);
    Weights weights = trainer_.weights();
    write_weights(options_.common.output / "weights.json", weights,
                  retrograde::text(state.step, " steps, seed ", options_.common.seed));
  }

  void restore(const apps::State& state) override { trainer_.restore(state); }

  const Trainer& trainer() const { return trainer_; }
  std::string name() const { return method_.name(); }

 private:
  const Options& options_;
  Gallery& held_out_;
  Trainer trainer_;
  Demosaicker method_;
};

}  // namespace

Learned learn(const Options& options, const Dataset& dataset, Gallery& held_out,
              apps::Report& report) {
  apps::LearningRun run("demosaic", options.common, {.looks = 40});
  FilterLearner learner(options, dataset, held_out);
  run.learn(learner);
  run.enter(report,
            {.loss_title = "learning " + learner.name(),
             .loss_label = "mean squared error of a batch, weighed",
             .quality_title = "held-out photographs while " + learner.name() + " is learned",
             .quality_label = "PSNR, sRGB [dB]",
             .log_loss = true});
  report.own["refused_steps"] = learner.trainer().adam().refused();
  return {learner.trainer().weights(), run.steps(), apps::stop_requested()};
}

apps::Table time_steps(const Options& options, const Dataset& dataset) {
  constexpr int timed = 15;
  apps::Table table{"a step of learning", {"groups", "stages of the gradient", "ms"}, {}};
  std::vector<std::vector<std::string>> choices{group_names};
  for (const std::string& group : group_names) choices.push_back({group});
  apps::CommonOptions common = options.common;
  common.steps = 1000;
  for (const auto& groups : choices) {
    common.optimize = groups;
    Trainer trainer(Weights(options.shape), dataset.train, {.common = common});
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
