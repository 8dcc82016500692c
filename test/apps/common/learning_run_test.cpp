// Tests the learning run, which counts steps, measures and saves at intervals, stops on request, and resumes from its
// state.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <vector>

#include "common/learning_run.h"
#include "common/stop.h"
#include "diagnostics/error.h"
#include "support/temporary_folder.h"

namespace {

// A number that halves at each step; its quality is the number of halvings.
class Halving : public apps::Learner {
 public:
  double step() override {
    const double loss = value;
    value /= 2;
    if (stop_at_value == value) apps::request_stop();
    return loss;
  }
  double look(long steps) override {
    looks.push_back(steps);
    return -std::log2(value);
  }
  void save(apps::State& state) override {
    saves.push_back(state.step);
    state.arrays["value"] = {value};
  }
  void restore(const apps::State& state) override { value = state.array("value", 1)[0]; }

  double value = 1, stop_at_value = 0;
  std::vector<long> looks, saves;
};

class LearningRun : public testing::Test {
 protected:
  LearningRun() { options_.output = folder_.path(); }
  ~LearningRun() override { apps::request_stop(false); }

  apps::LearningRun run(const apps::LearningRun::Plan& plan = {}) {
    return {"halving", options_, plan};
  }

  const TemporaryFolder folder_;
  apps::CommonOptions options_;
};

TEST_F(LearningRun, LooksAndSavesNowAndThen) {
  options_.steps = 10;
  auto steps = run({.looks = 3});
  Halving learner;
  steps.learn(learner);
  EXPECT_EQ(steps.steps(), 10);
  EXPECT_EQ(learner.looks, (std::vector<long>{0, 3, 6, 9, 10}));
  EXPECT_EQ(learner.saves, (std::vector<long>{3, 6, 9, 10}));
  options_.steps = 9;
  Halving other;
  auto rarely = run({.looks = 9, .least_between = 4});
  rarely.learn(other);
  EXPECT_EQ(other.looks, (std::vector<long>{0, 4, 8, 9}));
}

TEST_F(LearningRun, TheLastLookIsNotTakenTwice) {
  options_.steps = 4;
  auto steps = run({.looks = 2});
  Halving learner;
  steps.learn(learner);
  EXPECT_EQ(learner.looks, (std::vector<long>{0, 2, 4}));
}

TEST_F(LearningRun, GoesOnFromItsState) {
  options_.steps = 3;
  Halving first, second;
  run().learn(first);
  options_.steps = 5;
  options_.resume = true;
  auto rest = run();
  rest.learn(second);
  EXPECT_EQ(rest.steps(), 5);
  EXPECT_EQ(second.value, std::ldexp(1.0, -5));
  EXPECT_EQ(second.looks.front(), 3);
  // The smoothed loss of a resumed run begins at its first step.
  apps::Report report("halving", options_);
  rest.enter(report, {});
  const auto json = report.to_json(5, false);
  EXPECT_EQ(json["plots"][0]["series"][0]["y"][0], 0.125);
  EXPECT_EQ(json["plots"][1]["series"][0]["y"].back(), 5);
  EXPECT_GE(json["halving"]["ms_per_step"], 0);
}

TEST_F(LearningRun, StopsWithWhatItHas) {
  options_.steps = 1000;
  Halving learner;
  learner.stop_at_value = 0.25;
  auto stopped = run();
  stopped.learn(learner);
  EXPECT_EQ(stopped.steps(), 2);
  EXPECT_EQ(learner.saves.back(), 2);
  EXPECT_EQ(learner.looks, (std::vector<long>{0}));
  apps::request_stop(false);
  options_.seconds = 1e-9;
  Halving other;
  auto timed = run();
  timed.learn(other);
  EXPECT_EQ(timed.steps(), 1);
}

TEST_F(LearningRun, AStateOfAnotherProgramIsRefusedBeforeAnythingElse) {
  options_.resume = true;
  EXPECT_THROW(run(), retrograde::UserError);
  apps::write_state(folder_.path() / "state.bin", {.program = "doubling"});
  EXPECT_THROW(run(), retrograde::UserError);
}

}  // namespace
