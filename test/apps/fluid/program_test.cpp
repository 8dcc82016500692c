// Runs fluid on small pictures: it succeeds, its report agrees with its results, and it resumes after a stop.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "common/images.h"
#include "common/process.h"
#include "support/temporary_folder.h"

namespace {

namespace fs = std::filesystem;
using Words = std::vector<std::string>;

class Fluid : public testing::Test {
 protected:
  void SetUp() override { picture_ = write_bar("bar.png", 20, 16); }

  // Writes a picture with a bright bar on the right half.
  fs::path write_bar(const std::string& name, int width, int height) {
    apps::Image image{width, height, 8, {}};
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const bool inside = x >= width / 2 && x < 3 * width / 4 && y >= height / 5;
        image.pixels.insert(image.pixels.end(), 3, inside ? 1.0f : 0.0f);
      }
    }
    apps::write_image(folder_ / name, image);
    return folder_ / name;
  }

  Words command(const Words& more, const std::string& out = "out") const {
    Words words{FLUID_PROGRAM, "--input", picture_.string(), "--output", (folder_ / out).string(),
                "--frames",    "6",       "--force-nodes",   "4",        "--time-step",
                "0.15"};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }

  nlohmann::json report(const std::string& out = "out") const {
    std::ifstream file(folder_ / out / "report.json");
    return nlohmann::json::parse(file);
  }

  nlohmann::json run(const Words& more, const std::string& out = "out") {
    const apps::Outcome outcome = apps::run_program(command(more, out));
    EXPECT_EQ(outcome.status, 0) << outcome.output;
    said_ = outcome.output;
    return report(out);
  }

  const TemporaryFolder temporary_;
  const fs::path& folder_ = temporary_.path();
  fs::path picture_;
  std::string said_;
};

const Words force_only{"--optimize", "force", "--viscosity", "0", "--diffusion", "0"};

Words with(Words words, const Words& more) {
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

std::vector<double> losses(const nlohmann::json& report) {
  return report["plots"][0]["series"][0]["y"].get<std::vector<double>>();
}

TEST_F(Fluid, BringsSmokeToThePictureAndReportsIt) {
  const auto report =
      run(with(force_only, {"--steps", "60", "--method", "adam,lbfgs", "--explain"}));
  const auto& own = report["fluid"];
  EXPECT_EQ(own["width"], 20);
  EXPECT_EQ(own["height"], 16);
  EXPECT_EQ(own["variables"], 6 * 2 * 4 * 3);
  EXPECT_GT(own["psnr_final_db"], own["psnr_initial_db"].get<double>() + 4);
  EXPECT_GT(own["ms_per_gradient"], 0);
  EXPECT_EQ(own["states_kept"], 6);
  EXPECT_EQ(own["left_out"].size(), 2u);
  EXPECT_EQ(report["program"], "fluid");
  EXPECT_EQ(report["stopped"], false);
  const auto& series = report["plots"][0]["series"];
  ASSERT_EQ(series.size(), 2u);
  EXPECT_EQ(series[0]["name"], "adam");
  EXPECT_EQ(series[0]["y"].size(), 61u);
  EXPECT_EQ(series[1]["name"], "lbfgs");
  for (const char* name :
       {"start.png", "target.png", "result.png", "strip.png", "animation.gif", "error_vs_time.png",
        "state.bin", "frames/0000.png", "frames/0006.png"}) {
    EXPECT_TRUE(fs::exists(folder_ / "out" / name)) << name;
  }
  EXPECT_FALSE(fs::exists(folder_ / "out" / "frames" / "0007.png"));
  EXPECT_NE(said_.find("left out of the frame: viscosity: it is 0"), std::string::npos) << said_;
  EXPECT_NE(said_.find("left out of the frame: diffusion: it is 0"), std::string::npos) << said_;
  EXPECT_NE(said_.find("cost "), std::string::npos) << said_;
}

TEST_F(Fluid, MovesOnlyWhatItIsAskedTo) {
  const auto report = run({"--optimize", "diffusion", "--diffusion", "1e-3", "--viscosity", "0",
                           "--swirl", "0.5", "--steps", "8"});
  EXPECT_EQ(report["fluid"]["variables"], 1);
  EXPECT_NE(report["fluid"]["diffusion"], 1e-3);
  EXPECT_NEAR(report["fluid"]["time_step"].get<double>(), 0.15, 1e-12);
  EXPECT_EQ(report["fluid"]["viscosity"], 0);
  const auto series = losses(report);
  EXPECT_LT(series.back(), series.front());
}

TEST_F(Fluid, GoesOnAsIfItHadNotStopped) {
  // The rate decreases over the total number of steps, so all runs get the same total.
  const auto whole = run(with(force_only, {"--steps", "12"}), "whole");
  const Words limited = with(force_only, {"--steps", "12", "--seconds", "0.000001"});
  run(limited, "parts");  // stops after a step: its time is over
  const auto first = losses(report("parts"));
  ASSERT_EQ(first.size(), 2u);
  const auto second = run(with(force_only, {"--steps", "12", "--resume"}), "parts");
  EXPECT_EQ(losses(second), losses(whole));
  EXPECT_EQ(second["fluid"]["loss"], whole["fluid"]["loss"]);
}

TEST_F(Fluid, TakesItsForceFromAnotherRun) {
  run(with(force_only, {"--steps", "15"}), "first");
  const auto second = run({"--force-from", (folder_ / "first" / "state.bin").string(), "--optimize",
                           "time_step", "--viscosity", "0", "--diffusion", "0", "--steps", "5"},
                          "second");
  EXPECT_EQ(second["fluid"]["variables"], 1);
  // The loss no longer includes the cost of the force, but the smoke is where it was.
  EXPECT_NEAR(second["fluid"]["psnr_initial_db"].get<double>(),
              report("first")["fluid"]["psnr_final_db"].get<double>(), 0.01);
}

TEST_F(Fluid, TheResultDoesNotDependOnTheThreads) {
  const auto one = run(with(force_only, {"--steps", "3", "--threads", "1"}), "one");
  const auto three = run(with(force_only, {"--steps", "3", "--threads", "3"}), "three");
  EXPECT_EQ(losses(one), losses(three));
}

TEST_F(Fluid, LeavesItsBestResultWhenItIsInterrupted) {
  const Words words = command(with(force_only, {"--steps", "1000000"}));
  std::vector<char*> arguments;
  for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  const pid_t child = fork();
  if (child == 0) {
    ::execv(arguments[0], arguments.data());
    ::_exit(127);
  }
  std::this_thread::sleep_for(std::chrono::seconds(3));  // compiled, and some steps further
  ::kill(child, SIGINT);
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 0);
  const auto left = report();
  EXPECT_EQ(left["stopped"], true);
  EXPECT_LT(left["steps"], 1000000);
  EXPECT_TRUE(fs::exists(folder_ / "out" / "result.png"));
  EXPECT_TRUE(fs::exists(folder_ / "out" / "state.bin"));
}

TEST_F(Fluid, ChecksItsGradientsInsteadOfTheWork) {
  const auto report = run({"--check-gradients"});
  ASSERT_EQ(report["tables"].size(), 1u);
  EXPECT_EQ(report["tables"][0]["rows"].size(), 4u);
  for (const auto& row : report["tables"][0]["rows"]) {
    EXPECT_LE(row[2].get<double>(), 1e-6) << row;
    EXPECT_LE(row[3].get<double>(), 1e-3) << row;
  }
  EXPECT_FALSE(fs::exists(folder_ / "out" / "result.png"));
}

TEST_F(Fluid, ShapesOfAllKindsWork) {
  for (const auto& [width, height] : {std::pair{4, 4}, {33, 5}}) {
    SCOPED_TRACE(testing::Message() << width << " x " << height);
    picture_ = write_bar("shape.png", width, height);
    const auto report = run({"--steps", "1"});
    EXPECT_EQ(report["fluid"]["width"], width);
    EXPECT_EQ(report["fluid"]["height"], height);
    EXPECT_TRUE(report["fluid"]["loss"].is_number());
  }
}

}  // namespace
