// learning_run.h -- trains parameters on photographs: steps, evaluations on held-out photographs, state.bin, and the
// curves of loss and quality.
//
//   apps::LearningRun run("demosaic", options.common, {.looks = 40});  // reads the state of --resume, if it is wanted
//   MyLearner learner(...);                                            // compiles
//   run.learn(learner);
//   run.enter(report, {.loss_title = "learning nine filters"});
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/options.h"
#include "common/report.h"
#include "common/state.h"

namespace apps {

// The parameters to learn, and one training step.
class Learner {
 public:
  virtual ~Learner() = default;

  virtual double step() = 0;  // returns the loss before it
  // The quality on the held-out photographs after `steps` steps, in dB. The result is ignored once the run is stopped.
  virtual double look(long steps) = 0;
  // Saves to the state. Files of its own, such as weights, are written beside it.
  virtual void save(State& state) = 0;
  virtual void restore(const State& state) = 0;
};

class LearningRun {
 public:
  struct Plan {
    long looks = 20;         // evaluations over all steps; each also saves the state
    long least_between = 1;  // least number of steps between two
  };
  struct Titles {
    std::string loss_title, loss_label, quality_title, quality_label;
    bool log_loss = false;
  };

  // `options` must outlive it. Throws retrograde::UserError if the state is not one of `program`.
  LearningRun(std::string program, const CommonOptions& options, const Plan& plan);

  // Steps until they are done, the time limit --seconds is reached or the user stops it. Time for evaluations and files
  // does not count. The last evaluation is of the final parameters, unless the user stops the run.
  void learn(Learner& learner);

  // Adds both curves, error_vs_time.png and psnr_vs_time.png, and the time of a step.
  void enter(Report& report, const Titles& titles) const;

  long steps() const { return steps_; }
  double seconds() const { return seconds_; }
  double ms_per_step() const;  // the median

 private:
  bool is_over() const;
  void step(Learner& learner);
  void look(Learner& learner);
  void save(Learner& learner) const;

  const std::string program_;
  const CommonOptions& options_;
  const Plan plan_;
  std::optional<State> state_;  // the state to continue from
  long steps_ = 0;
  double seconds_ = 0;
  std::vector<double> step_seconds_;
  PlotSeries loss_{"training batches, smoothed", {}, {}}, quality_{"held out", {}, {}};
};

}  // namespace apps
