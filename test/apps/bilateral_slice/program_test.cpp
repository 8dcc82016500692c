// Runs bilateral_slice on small images of awkward shapes: it succeeds, and its report agrees with its results.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "common/images.h"
#include "common/process.h"
#include "common/state.h"
#include "support/temporary_folder.h"

namespace {

namespace fs = std::filesystem;

class BilateralSlice : public testing::Test {
 protected:
  fs::path write_photo(const std::string& name, int width, int height, float power = 1,
                       int channels = 3) {
    apps::Image image{width, height, 8, {}, channels};
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        for (int c = 0; c < channels; ++c) {
          const double wave = 0.5 + 0.4 * std::sin(0.31 * x + 0.5 * c) * std::cos(0.17 * y);
          image.pixels.push_back(std::pow(static_cast<float>(wave), power));
        }
      }
    }
    apps::write_png(folder_ / name, image);
    return folder_ / name;
  }

  // Runs the program, and returns its output.
  std::string output_of(const std::vector<std::string>& more) {
    std::vector<std::string> command{BILATERAL_SLICE_PROGRAM, "--output",
                                     (folder_ / "out").string()};
    command.insert(command.end(), more.begin(), more.end());
    const apps::Outcome outcome = apps::run_program(command);
    EXPECT_EQ(outcome.status, 0) << outcome.output;
    return outcome.output;
  }

  nlohmann::json report() const {
    std::ifstream file(folder_ / "out" / "report.json");
    return nlohmann::json::parse(file);
  }

  // Runs the program without plots, for tests that do not look at them.
  std::string without_plots(const std::vector<std::string>& words) {
    setenv("RETROGRADE_PYTHON", "/bin/true", 1);
    const std::string text = output_of(words);
    unsetenv("RETROGRADE_PYTHON");
    return text;
  }

  // Writes a look whose layers and coefficients all differ and are exact in float32.
  fs::path write_uneven_look(const std::string& name, int nodes) const {
    const auto held = [](double value) { return static_cast<double>(static_cast<float>(value)); };
    apps::State look{.program = "bilateral_slice look"};
    look.arrays["sizes"] = {1.0 * nodes, 1.0 * nodes, 8, 16};
    look.arrays["channels"] = {3};
    look.arrays["mix"] = {held(0.3), held(0.4), held(0.25), held(0.02)};
    for (int n = 0; n < 12 * 8 * nodes * nodes; ++n)
      look.arrays["grid"].push_back(held((n % 4 == n / 4 % 3 ? 1 : 0) + 0.1 * std::sin(n)));
    for (int n = 0; n < 16; ++n) look.arrays["curve"].push_back(held(n == 0 ? 0.9 : 0.01 * n));
    apps::write_state(folder_ / name, look);
    return folder_ / name;
  }

  // Copies the look that the last run learned, because the next run overwrites it.
  fs::path kept_look(const std::string& name) const {
    fs::copy_file(folder_ / "out" / "look.bin", folder_ / name);
    return folder_ / name;
  }

  static std::vector<double> part_of(const fs::path& look, const std::string& name) {
    return apps::read_state(look, "bilateral_slice look").arrays.at(name);
  }

  nlohmann::json run(const std::vector<std::string>& more) {
    output_of(more);
    for (const char* name : {"input.png", "target.png", "result.png", "error_against_time.png"}) {
      EXPECT_TRUE(fs::exists(folder_ / "out" / name)) << name;
    }
    return report();
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
  const auto report = run({"--input", photo, "--steps", "12", "--threads", "2", "--grid", "16"});
  ASSERT_EQ(report["halide"]["psnr_db"].size(), 12);
  // Both run the same function for the same steps: only rounding differs.
  for (int step = 0; step < 12; ++step) {
    EXPECT_NEAR(report["halide"]["psnr_db"][step].get<double>(),
                report["retrograde"]["psnr_db"][step].get<double>(), 0.02)
        << "step " << step;
  }
  EXPECT_GT(report["ratio_to_halide"], 0);
}

// Groups that are not learned cost nothing: a smaller gradient, no step, and no comparison with Halide.
TEST_F(BilateralSlice, MovesOnlyWhatItIsTold) {
  const auto photo = write_photo("photo.png", 64, 48),
             target = write_photo("target.png", 64, 48, 0.5f);
  const auto with = [&](std::vector<std::string> more, const char* halide_seconds = "0") {
    more.insert(more.begin(), {"--input", photo, "--target", target, "--steps", "15", "--grid", "8",
                               "--halide-seconds", halide_seconds});
    return more;
  };
  without_plots(with({}));
  const auto all = report();
  EXPECT_EQ(all["optimize"], "grid,mix,curve");
  EXPECT_TRUE(all["left_out"].empty());
  const std::string text = without_plots(with({"--optimize", "grid", "--explain"}, "9"));
  EXPECT_NE(text.find("left out: the adjoints of depth and guide"), std::string::npos) << text;
  EXPECT_NE(text.find("cannot measure Halide 14"), std::string::npos) << text;
  const auto grid = report();
  EXPECT_EQ(grid["optimize"], "grid");
  EXPECT_EQ(grid["left_out"].size(), 1u);
  EXPECT_LE(grid["gradient_check_derivatives"], all["gradient_check_derivatives"].get<int>() / 2);
  EXPECT_GT(grid["psnr_final_db"], grid["psnr_initial_db"].get<double>() + 5);
  // The first loss is that of the same identity, the last one differs.
  EXPECT_EQ(grid["retrograde"]["psnr_db"][0], all["retrograde"]["psnr_db"][0]);
  EXPECT_NE(grid["retrograde"]["psnr_db"][14], all["retrograde"]["psnr_db"][14]);
  const fs::path look = kept_look("grid.look");
  EXPECT_EQ(part_of(look, "curve")[0], 1);
  EXPECT_EQ(part_of(look, "curve")[1], 0);

  without_plots(with({"--optimize", "mix,curve", "--start", look}));
  const auto guide = report();
  EXPECT_EQ(guide["left_out"].size(), 1u);
  EXPECT_LE(guide["gradient_check_max_relative_error"], 1e-3);
  const auto& series = guide["retrograde"]["psnr_db"];
  EXPECT_NEAR(series[0].get<double>(), grid["psnr_final_db"].get<double>(), 1e-3);
  EXPECT_GT(series[14], series[0]);
  const fs::path moved = kept_look("guide.look");
  EXPECT_EQ(part_of(moved, "grid"), part_of(look, "grid"));
  EXPECT_NE(part_of(moved, "mix"), part_of(look, "mix"));
  EXPECT_NE(part_of(moved, "curve"), part_of(look, "curve"));
}

// From the same point, a step moves a group equally, whether other groups move or not.
TEST_F(BilateralSlice, AGroupMovesAlikeBesideOthers) {
  const auto photo = write_photo("photo.png", 30, 24);
  const fs::path start = write_uneven_look("start.look", 4);
  const auto step = [&](const std::string& groups) {
    without_plots({"--input", photo, "--steps", "1", "--halide-seconds", "0", "--start", start,
                   "--optimize", groups});
    return kept_look(groups + ".look");
  };
  const fs::path all = step("grid,mix,curve"), grid = step("grid"), guide = step("curve,mix");
  EXPECT_NE(part_of(all, "grid"), part_of(start, "grid"));
  EXPECT_NE(part_of(all, "mix"), part_of(start, "mix"));
  EXPECT_EQ(part_of(grid, "grid"), part_of(all, "grid"));
  EXPECT_EQ(part_of(grid, "mix"), part_of(start, "mix"));
  EXPECT_EQ(part_of(guide, "curve"), part_of(all, "curve"));
  EXPECT_EQ(part_of(guide, "mix"), part_of(all, "mix"));
  EXPECT_EQ(part_of(guide, "grid"), part_of(start, "grid"));
}

TEST_F(BilateralSlice, GrayStaysGray) {
  const auto photo = write_photo("photo.png", 60, 44, 1, 1),
             target = write_photo("target.png", 60, 44, 0.5f, 1);
  const auto gray = run({"--input", photo, "--target", target, "--steps", "15", "--grid", "8",
                         "--halide-seconds", "0"});
  EXPECT_EQ(gray["channels"], 1);
  EXPECT_EQ(gray["grid"], nlohmann::json::parse("[8, 8, 8, 2]"));
  EXPECT_EQ(gray["left_out"].size(), 1u);
  EXPECT_GT(gray["psnr_final_db"], gray["psnr_initial_db"].get<double>() + 5);
  EXPECT_LE(gray["gradient_check_max_relative_error"], 1e-3);
  for (const char* name : {"input.png", "target.png", "result.png"})
    EXPECT_EQ(apps::read_channels(folder_ / "out" / name).channels, 1) << name;
  const fs::path other = write_photo("other.png", 31, 27, 1, 2);  // gray and alpha
  output_of({"--apply", kept_look("gray.look"), "--input", other});
  EXPECT_EQ(apps::read_channels(folder_ / "out" / "result.png").channels, 1);
}

// One target in colour makes the whole run a colour run, and a look in colour also applies to gray photographs.
TEST_F(BilateralSlice, GrayBesideColourIsColour) {
  const auto photo = write_photo("photo.png", 60, 44, 1, 1);
  const auto target = write_photo("target.png", 60, 44, 0.5f);
  without_plots({"--input", photo, "--target", target, "--steps", "1", "--grid", "8",
                 "--halide-seconds", "0"});
  EXPECT_EQ(report()["channels"], 3);
  EXPECT_EQ(apps::read_channels(folder_ / "out" / "input.png").channels, 3);
  output_of({"--apply", kept_look("colours.look"), "--input", photo});
  EXPECT_EQ(apps::read_channels(folder_ / "out" / "result.png").channels, 3);
}

// Three equal channels through the colour model give the result of one channel through the gray model.
TEST_F(BilateralSlice, TheGrayEditIsThatOfEqualColours) {
  const auto gray = write_photo("gray.png", 50, 40, 1, 1);
  apps::write_png(folder_ / "spread.png", apps::read_image(gray));
  const std::vector<std::string> common{"--steps", "1", "--grid", "4", "--halide-seconds", "0"};
  const auto target_of = [&](const fs::path& photo) {
    auto words = common;
    words.insert(words.end(), {"--input", photo});
    without_plots(words);
    return apps::read_image(folder_ / "out" / "target.png");
  };
  const apps::Image one = target_of(gray), three = target_of(folder_ / "spread.png");
  ASSERT_EQ(one.pixels.size(), three.pixels.size());
  for (size_t n = 0; n < one.pixels.size(); ++n)
    ASSERT_NEAR(one.pixels[n], three.pixels[n], 1.01 / 255) << n;  // a step of 8 bits
}

TEST_F(BilateralSlice, StepsTakeLessWhenLessMoves) {
  output_of({"--time-steps", "--input", write_photo("photo.png", 48, 40), "--grid", "6"});
  const auto rows = report()["tables"][0]["rows"];
  ASSERT_EQ(rows.size(), 7u);
  EXPECT_EQ(rows[0][0], "grid,mix,curve");
  const int all = rows[0][2];
  for (size_t n = 1; n < 5; ++n) EXPECT_LT(rows[n][2], all) << rows[n];
  EXPECT_EQ(rows[5][1], 1);
  for (const auto& row : rows) EXPECT_GT(row[4], 0) << row;
}

class BilateralSliceShapes : public BilateralSlice,
                             public testing::WithParamInterface<std::pair<int, int>> {};

TEST_P(BilateralSliceShapes, ThatHardlyFillTheGridWork) {
  const auto [width, height] = GetParam();
  const auto photo = write_photo("photo.png", width, height);
  const auto report =
      run({"--input", photo, "--steps", "2", "--threads", "1", "--halide-seconds", "0"});
  EXPECT_EQ(report["width"], width);
  EXPECT_EQ(report["height"], height);
  EXPECT_LE(report["gradient_check_max_relative_error"], 1e-3);
}

INSTANTIATE_TEST_SUITE_P(Small, BilateralSliceShapes,
                         testing::Values(std::pair{4, 4}, std::pair{64, 4}, std::pair{5, 65},
                                         std::pair{127, 6}));

TEST_F(BilateralSlice, TheResultDoesNotDependOnTheThreads) {
  const auto photo = write_photo("photo.png", 100, 80);
  const std::vector<std::string> common{"--input", photo, "--steps", "5", "--halide-seconds", "0"};
  auto one = common, three = common;
  one.insert(one.end(), {"--threads", "1"});
  three.insert(three.end(), {"--threads", "3"});
  without_plots(one);
  const auto by_one = report();
  without_plots(three);
  EXPECT_EQ(by_one["retrograde"]["psnr_db"], report()["retrograde"]["psnr_db"]);
}

TEST_F(BilateralSlice, GoesOnWhereItWasToTheSameResult) {
  const auto photo = write_photo("photo.png", 64, 48);
  const std::vector<std::string> common{"--input",          photo, "--threads", "1",
                                        "--halide-seconds", "0"};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.begin(), common.begin(), common.end());
    without_plots(more);
    return report();
  };
  const auto whole = with({"--steps", "20"});
  // A limit of a tenth of a microsecond has passed after the first block of five steps.
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

// One curve for all photographs: learned from four of them, it suits the two held out, and a seventh.
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

// Gray photographs beside one in colour are learned in colour; among themselves they stay gray.
TEST_F(BilateralSlice, AFolderIsGrayWhereAllAre) {
  const fs::path pairs = folder_ / "pairs";
  fs::create_directories(pairs);
  for (int n = 0; n < 3; ++n)
    write_photo("pairs/p" + std::to_string(n) + ".png", 40, 30 + n, 1.0f + 0.1f * n, 1);
  const std::vector<std::string> words{"--pairs", pairs, "--steps", "8"};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.begin(), words.begin(), words.end());
    return without_plots(more);
  };
  with({"--optimize", "grid"});
  EXPECT_EQ(report()["bilateral_slice"]["channels"], 1);
  EXPECT_EQ(report()["bilateral_slice"]["left_out"].size(), 2u);
  EXPECT_EQ(apps::read_channels(folder_ / "out" / "result.png").channels, 1);
  // A run that stops after one step and resumes must arrive at the same look.
  const fs::path whole = kept_look("whole.look");
  with({"--optimize", "grid", "--seconds", "1e-9"});
  EXPECT_EQ(report()["steps"], 1);
  with({"--optimize", "grid", "--resume"});
  EXPECT_EQ(part_of(folder_ / "out" / "look.bin", "grid"), part_of(whole, "grid"));
  write_photo("pairs/p3.png", 40, 30);
  with({});
  EXPECT_EQ(report()["bilateral_slice"]["channels"], 3);
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

class BilateralSliceGradients : public BilateralSlice,
                                public testing::WithParamInterface<std::pair<std::string, int>> {};

TEST_P(BilateralSliceGradients, AreCheckedInsteadOfLearning) {
  const auto& [groups, inputs] = GetParam();
  const auto photo = write_photo("photo.png", 60, 50);
  const apps::Outcome outcome =
      apps::run_program({BILATERAL_SLICE_PROGRAM, "--output", (folder_ / "out").string(), "--input",
                         photo, "--check-gradients", "--check-side", "24", "--optimize", groups});
  EXPECT_EQ(outcome.status, 0) << outcome.output;
  EXPECT_FALSE(fs::exists(folder_ / "out" / "result.png"));
  EXPECT_TRUE(fs::exists(folder_ / "out" / "gradients.png"));
  std::ifstream file(folder_ / "out" / "gradients.json");
  const auto report = nlohmann::json::parse(file);
  ASSERT_EQ(report["inputs"].size(), inputs);
  EXPECT_EQ(report["complex_step_refused"], "");
  for (const auto& input : report["inputs"]) {
    EXPECT_LE(input["complex_step_error"], 1e-9) << outcome.output;
    EXPECT_LE(input["dot_product_error"], 1e-9) << outcome.output;
    EXPECT_LE(input["own_precision_error"], 1e-3) << outcome.output;
  }
}

INSTANTIATE_TEST_SUITE_P(Groups, BilateralSliceGradients,
                         testing::Values(std::pair{"grid", 1}, std::pair{"mix,curve", 2}));

}  // namespace
