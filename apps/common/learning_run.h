// learning_run.h -- numbers learned from photographs: the steps, looks at photographs that are held out, state.bin, and
// the curves of both.
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

// What is learned, and how.
class Learner {
 public:
  virtual ~Learner() = default;

  virtual double step() = 0;  // returns the loss before it
  // The quality on what is held out, in dB, after so many steps; any number once somebody stops it.
  virtual double look(long steps) = 0;
  // Into the state; files of its own, as of weights, are written beside it.
  virtual void save(State& state) = 0;
  virtual void restore(const State& state) = 0;
};

class LearningRun {
 public:
  struct Plan {
    long looks = 20;         // over all steps; at each the state is saved, too
    long least_between = 1;  // steps
  };
  struct Titles {
    std::string loss_title, loss_label, quality_title, quality_label;
    bool log_loss = false;
  };

  // The options must outlive it. Throws retrograde::UserError for a state that is none of `program`.
  LearningRun(std::string program, const CommonOptions& options, const Plan& plan);

  // Steps until they are done, --seconds are over or somebody stops it. What looks and files take does not count. The
  // last look is at what is left in the learner, unless somebody stops it: then there is no more look.
  void learn(Learner& learner);

  // Both curves, error_vs_time.png and psnr_vs_time.png, and the time of a step.
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
  std::optional<State> state_;  // to go on from
  long steps_ = 0;
  double seconds_ = 0;
  std::vector<double> step_seconds_;
  PlotSeries loss_{"training batches, smoothed", {}, {}}, quality_{"held out", {}, {}};
};

}  // namespace apps
