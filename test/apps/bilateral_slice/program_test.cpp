// bilateral_slice on small images of awkward shapes: it ends well, and its report keeps its
// promises.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "common/images.h"
#include "common/process.h"
#include "support/temporary_folder.h"

namespace {

namespace fs = std::filesystem;

class BilateralSlice : public testing::Test {
 protected:
  fs::path write_photo(const std::string& name, int width, int height, float power = 1) {
    apps::Image image{width, height, 8, {}};
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        for (int c = 0; c < 3; ++c) {
          const double wave = 0.5 + 0.4 * std::sin(0.31 * x + 0.5 * c) * std::cos(0.17 * y);
          image.pixels.push_back(std::pow(static_cast<float>(wave), power));
        }
      }
    }
    apps::write_png(folder_ / name, image);
    return folder_ / name;
  }

  nlohmann::json run(const std::vector<std::string>& more) {
    std::vector<std::string> command{BILATERAL_SLICE_PROGRAM, "--output",
                                     (folder_ / "out").string()};
    command.insert(command.end(), more.begin(), more.end());
    const apps::Outcome outcome = apps::run_program(command);
    EXPECT_EQ(outcome.status, 0) << outcome.output;
    for (const char* name : {"input.png", "target.png", "result.png", "error_against_time.png"}) {
      EXPECT_TRUE(fs::exists(folder_ / "out" / name)) << name;
    }
    std::ifstream file(folder_ / "out" / "report.json");
    return nlohmann::json::parse(file);
  }

  const TemporaryFolder temporary_;
  const fs::path& folder_ = temporary_.path();
};

TEST_F(BilateralSlice, LearnsACurveAndReportsIt) {
  const auto photo = write_photo("photo.png", 150, 90);
  const auto target = write_photo("target.png", 150, 90, 0.5f);
  const auto report = run({"--input", photo, "--target", target, "--steps", "60", "--threads", "2",
                           "--halide-seconds", "0"});
  EXPECT_EQ(report["width"], 150);
  EXPECT_EQ(report["height"], 90);
  EXPECT_EQ(report["steps"], 60);
  EXPECT_GT(report["psnr_final_db"], report["psnr_initial_db"].get<double>() + 10);
  EXPECT_LE(report["gradient_check_max_relative_error"], 1e-3);
  EXPECT_GT(report["ms_per_step"], 0);
  EXPECT_GT(report["seconds"], 0);
  EXPECT_GT(report["peak_memory_mb"], 0);
  EXPECT_TRUE(report["halide_ms_per_step"].is_null());
  EXPECT_TRUE(report["ratio_to_halide"].is_null());
  EXPECT_EQ(report["retrograde"]["psnr_db"].size(), 60);
}

TEST_F(BilateralSlice, HalideTakesTheSameSteps) {
  const auto photo = write_photo("photo.png", 120, 70);
  const auto report = run({"--input", photo, "--steps", "12", "--threads", "2"});
  ASSERT_EQ(report["halide"]["psnr_db"].size(), 12);
  // The same function and the same steps: only rounding differs.
  for (int step = 0; step < 12; ++step) {
    EXPECT_NEAR(report["halide"]["psnr_db"][step].get<double>(),
                report["retrograde"]["psnr_db"][step].get<double>(), 0.02)
        << "step " << step;
  }
  EXPECT_GT(report["ratio_to_halide"], 0);
}

TEST_F(BilateralSlice, ShapesThatHardlyFillTheGridWork) {
  for (const auto& [width, height] : {std::pair{4, 4}, {64, 4}, {5, 65}, {127, 6}}) {
    SCOPED_TRACE(testing::Message() << width << " x " << height);
    const auto photo = write_photo("photo.png", width, height);
    const auto report =
        run({"--input", photo, "--steps", "2", "--threads", "1", "--halide-seconds", "0"});
    EXPECT_EQ(report["width"], width);
    EXPECT_EQ(report["height"], height);
    EXPECT_LE(report["gradient_check_max_relative_error"], 1e-3);
  }
}

TEST_F(BilateralSlice, TheResultDoesNotDependOnTheThreads) {
  const auto photo = write_photo("photo.png", 100, 80);
  const std::vector<std::string> common{"--input", photo, "--steps", "5", "--halide-seconds", "0"};
  auto one = common, three = common;
  one.insert(one.end(), {"--threads", "1"});
  three.insert(three.end(), {"--threads", "3"});
  EXPECT_EQ(run(one)["retrograde"]["psnr_db"], run(three)["retrograde"]["psnr_db"]);
}

TEST_F(BilateralSlice, GoesOnWhereItWasToTheSameResult) {
  const auto photo = write_photo("photo.png", 64, 48);
  const std::vector<std::string> common{"--input",          photo, "--threads", "1",
                                        "--halide-seconds", "0"};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.begin(), common.begin(), common.end());
    return run(more);
  };
  const auto whole = with({"--steps", "20"});
  // A tenth of a microsecond is over after the first block of five steps.
  EXPECT_EQ(with({"--steps", "20", "--seconds", "1e-7"})["steps"], 5);
  const auto rest = with({"--steps", "20", "--resume"});
  EXPECT_EQ(rest["steps"], 15);
  EXPECT_EQ(rest["psnr_final_db"], whole["psnr_final_db"]);
}

TEST_F(BilateralSlice, StopsInGoodOrder) {
  const auto photo = write_photo("photo.png", 64, 48);
  const apps::Outcome outcome = apps::run_program(
      {"timeout", "--preserve-status", "-s", "INT", "3", BILATERAL_SLICE_PROGRAM, "--input", photo,
       "--output", folder_ / "out", "--steps", "1000000", "--halide-seconds", "0"});
  EXPECT_EQ(outcome.status, 0) << outcome.output;
  EXPECT_NE(outcome.output.find("it was stopped"), std::string::npos) << outcome.output;
  std::ifstream file(folder_ / "out" / "report.json");
  EXPECT_EQ(nlohmann::json::parse(file)["stopped"], true);
}

// One curve for all photos: what was learned from four of them suits the two held out, and a seventh.
TEST_F(BilateralSlice, LearnsOneLookFromAFolderAndAppliesIt) {
  const fs::path pairs = folder_ / "pairs";
  fs::create_directories(pairs / "target");
  for (int n = 0; n < 7; ++n) {
    const std::string name = "p" + std::to_string(n) + ".png";
    write_photo("pairs/" + name, 60 + 8 * n, 50);
    write_photo("pairs/target/" + name, 60 + 8 * n, 50, 0.5f);
  }
  const std::vector<std::string> command{BILATERAL_SLICE_PROGRAM, "--output", folder_ / "out"};
  auto learn = command;
  learn.insert(learn.end(), {"--pairs", pairs, "--steps", "250", "--explain"});
  const apps::Outcome learned = apps::run_program(learn);
  ASSERT_EQ(learned.status, 0) << learned.output;
  std::ifstream file(folder_ / "out" / "report.json");
  const auto own = nlohmann::json::parse(file)["bilateral_slice"];
  EXPECT_EQ(own["photographs"], 5);
  EXPECT_EQ(own["held_out"], 2);
  EXPECT_GT(own["psnr_held_out_db"], own["psnr_held_out_before_db"].get<double>() + 6);
  const auto photo = write_photo("new.png", 81, 43),
             wanted = write_photo("wanted.png", 81, 43, 0.5f);
  auto apply = command;
  apply.insert(apply.end(), {"--apply", folder_ / "out" / "look.bin", "--input", photo});
  const apps::Outcome applied = apps::run_program(apply);
  ASSERT_EQ(applied.status, 0) << applied.output;
  const apps::Image result = apps::read_image(folder_ / "out" / "result.png"),
                    target = apps::read_image(wanted);
  ASSERT_EQ(result.pixels.size(), target.pixels.size());
  double sum = 0;
  for (size_t n = 0; n < target.pixels.size(); ++n)
    sum += std::pow(result.pixels[n] - target.pixels[n], 2);
  EXPECT_LT(sum / static_cast<double>(target.pixels.size()), 2e-3);  // 27 dB
}

TEST_F(BilateralSlice, ItsGradientIsStableWhereTheGridIsEmpty) {
  const apps::Outcome outcome =
      apps::run_program({BILATERAL_SLICE_PROGRAM, "--output", folder_ / "out", "--input",
                         write_photo("photo.png", 8, 8), "--check-stability"});
  ASSERT_EQ(outcome.status, 0) << outcome.output;
  std::ifstream file(folder_ / "out" / "report.json");
  const auto rows = nlohmann::json::parse(file)["tables"][0]["rows"];
  EXPECT_GE(rows.size(), 7u);
  for (const auto& row : rows) {
    ASSERT_TRUE(row[1].is_number()) << row.dump();
    EXPECT_LT(row[1], 1e-4) << row.dump();
    EXPECT_LT(row[2], 1e-3) << row.dump();
    EXPECT_EQ(row[4], "never") << row.dump();
  }
}

TEST_F(BilateralSlice, ChecksItsGradientsInsteadOfLearning) {
  const auto photo = write_photo("photo.png", 60, 50);
  const apps::Outcome outcome =
      apps::run_program({BILATERAL_SLICE_PROGRAM, "--output", (folder_ / "out").string(), "--input",
                         photo, "--check-gradients"});
  EXPECT_EQ(outcome.status, 0) << outcome.output;
  EXPECT_FALSE(fs::exists(folder_ / "out" / "result.png"));
  EXPECT_TRUE(fs::exists(folder_ / "out" / "gradients.png"));
  std::ifstream file(folder_ / "out" / "gradients.json");
  const auto report = nlohmann::json::parse(file);
  ASSERT_EQ(report["inputs"].size(), 3u);
  EXPECT_EQ(report["complex_step_refused"], "");
  for (const auto& input : report["inputs"]) {
    EXPECT_LE(input["complex_step_error"], 1e-9) << outcome.output;
    EXPECT_LE(input["dot_product_error"], 1e-9) << outcome.output;
    EXPECT_LE(input["own_precision_error"], 1e-3) << outcome.output;
  }
}

}  // namespace
