// Runs burst_superresolution from a photograph or a folder of mosaics to pictures and a report. Also tests the gain by
// the optimization, and stopping and resuming.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>

#include "burst_superresolution/fit.h"
#include "burst_superresolution/pilot.h"
#include "burst_superresolution/quality.h"
#include "common/images.h"
#include "common/process.h"
#include "common/stop.h"
#include "scenes.h"
#include "support/temporary_folder.h"

namespace {

namespace fs = std::filesystem;
using namespace burst;
using burst_test::scene;
using nlohmann::json;

class BurstRun : public testing::Test {
 protected:
  BurstRun() { options_.common.output = folder_.path(); }

  // Simulates a burst from 110 x 90 pixels of a scene.
  void simulate_burst(int frames, double noise) {
    options_.simulation = {.frames = frames, .shake = 4, .noise = noise, .seed = 3};
    burst_ = simulate(scene(140, 120), options_.simulation);
    prepared_ = prepare(burst_, options_.colours, {}, 2);
    ASSERT_EQ(burst_.frames(), frames);
    compile();
  }
  void compile() {
    evaluator_.emplace(shape(), prepared_.smoothness, options_.moves, 2);
    evaluator_->set_frames(burst_.samples);
  }
  Shape shape() const { return {burst_.size, burst_.frames()}; }

  Fit fit_for(long steps, bool resume = false) {
    options_.common.steps = steps;
    options_.common.resume = resume;
    return fit(options_, burst_, prepared_, *evaluator_, shown_);
  }
  double db(std::span<const float> planes) { return psnr_db(planes, *burst_.truth, burst_.size); }
  double error_of(const std::vector<Homography>& found) {
    return motion_error(found, burst_.truth->homographies, burst_.size).mean;
  }

  const TemporaryFolder folder_;
  Options options_;
  Burst burst_;
  Prepared prepared_;
  std::optional<Evaluator<float>> evaluator_;
  std::function<void(const Sample&)> shown_ = [](const Sample&) {};
};

TEST_F(BurstRun, GainsTwoDecibelsAndFindsTheMotion) {
  simulate_burst(9, 0.005);
  choose_smoothness(options_, burst_, prepared_, *evaluator_);
  EXPECT_NEAR(prepared_.noise, 0.005, 0.003);
  // Moves the frames by a fourth of a pixel from the positions that SIFT found.
  for (size_t n = 1; n < 9; ++n) prepared_.homographies[n][2] += 0.25 / burst_.size.scale();
  const Fit found = fit_for(100);
  const double best = std::max(db(prepared_.first), db(prepared_.average));
  EXPECT_GE(db(found.picture(shape())), best + 2);
  EXPECT_LT(found.loss, found.series.front().loss);
  // A hundred steps of at most 1e-4, decreasing to a tenth, move at most a fifth of a pixel here.
  EXPECT_LT(error_of(found.homographies(shape())), 0.8 * error_of(prepared_.homographies));
  EXPECT_EQ(found.refused, 0);
}

TEST_F(BurstRun, MovesOnlyWhatIsNamed) {
  simulate_burst(3, 0.01);
  options_.moves = {true, false};
  compile();
  const Fit picture = fit_for(5);
  for (size_t n = 0; n < 3; ++n) {
    for (size_t k = 0; k < 8; ++k) {
      EXPECT_EQ(static_cast<float>(picture.homographies(shape())[n][k]),
                static_cast<float>(prepared_.homographies[n][k]));
    }
  }
  options_.moves = {false, true};
  compile();
  const Fit motion = fit_for(5);
  EXPECT_TRUE(std::equal(prepared_.first.begin(), prepared_.first.end(), motion.x.begin()));
  EXPECT_LT(motion.loss, motion.series.front().loss);
}

TEST_F(BurstRun, GoesOnAsIfItHadNotStopped) {
  simulate_burst(3, 0.01);
  shown_ = [](const Sample& sample) {
    if (sample.step == 6) apps::request_stop();
  };
  const Fit half = fit_for(12);
  apps::request_stop(false);
  EXPECT_TRUE(half.stopped);
  EXPECT_LE(half.steps, 7);
  shown_ = [](const Sample&) {};
  const Fit rest = fit_for(12, true);
  EXPECT_EQ(rest.steps, 12);
  EXPECT_EQ(rest.series.size(), 13u);
  EXPECT_EQ(rest.x, fit_for(12).x);
  options_.common.seed = 77;  // another burst
  EXPECT_THROW(fit_for(14, true), retrograde::UserError);
}

class BurstProgram : public testing::Test {
 protected:
  // Writes a scene as a picture, and returns its name.
  fs::path photograph(int width, int height) {
    const auto picture = scene(width, height);
    apps::write_image(folder_.path() / "scene.png",
                      demosaic::image_of(width, height, 8, picture.planes));
    return folder_.path() / "scene.png";
  }

  std::string run(const fs::path& input, const fs::path& out, const std::vector<std::string>& more,
                  const std::string& steps = "6") {
    std::vector<std::string> words{BURST_PROGRAM, "--input", input,       "--output", out,
                                   "--steps",     steps,     "--threads", "2"};
    words.insert(words.end(), more.begin(), more.end());
    const apps::Outcome outcome = apps::run_program(words);
    EXPECT_EQ(outcome.status, 0) << outcome.output;
    return outcome.output;
  }
  static json report(const fs::path& out) {
    std::ifstream file(out / "report.json");
    return json::parse(file)["burst_superresolution"];
  }

  const TemporaryFolder folder_;
};

TEST_F(BurstProgram, MakesAPictureAndAReport) {
  const fs::path out = folder_.path() / "out";
  run(photograph(120, 110), out, {"--frames", "4", "--shake", "3"});
  for (const char* name : {"result.png", "ahd.png", "average.png", "truth.png", "frame.png",
                           "enlarged.png", "homographies.json", "state.bin", "error_vs_time.png",
                           "psnr_vs_time.png", "motion_vs_time.png"})
    EXPECT_TRUE(fs::exists(out / name)) << name;
  const json own = report(out);
  EXPECT_GT(own["psnr_db"]["ours"], own["psnr_db"]["AHD of the first frame"]);
  EXPECT_EQ(own["frames"].size(), 4u);
  const apps::Image result = apps::read_image(out / "result.png");
  EXPECT_EQ(result.width, own["width"]);
  EXPECT_EQ(result.height, own["height"]);
}

// Mosaics that a run wrote can be read again, and give the same picture up to rounding to 16 bits.
TEST_F(BurstProgram, ReadsAFolderOfMosaics) {
  const fs::path one = folder_.path() / "one", two = folder_.path() / "two";
  run(photograph(110, 100), one, {"--frames", "3", "--shake", "3", "--write-frames"});
  run(one / "frames", two, {"--mosaic", "RGGB"});
  const apps::Image a = apps::read_image(one / "result.png"),
                    b = apps::read_image(two / "result.png");
  ASSERT_EQ(a.pixels.size(), b.pixels.size());
  double sum = 0;
  for (size_t n = 0; n < a.pixels.size(); ++n) sum += std::abs(a.pixels[n] - b.pixels[n]);
  EXPECT_LT(sum / static_cast<double>(a.pixels.size()), 0.004);
  EXPECT_FALSE(report(two).contains("psnr_db"));
  EXPECT_EQ(report(two)["frames"][2], "frame_02.png");
}

TEST_F(BurstProgram, OneFrameIsEnoughAndSecondsEndIt) {
  const fs::path out = folder_.path() / "out";
  const std::string said =
      run(photograph(90, 80), out,
          {"--frames", "1", "--lambda", "0", "--explain", "--seconds", "0.2"}, "100000");
  EXPECT_NE(said.find("left out: homographies and interpolation"), std::string::npos) << said;
  EXPECT_NE(said.find("left out: differences of neighbours"), std::string::npos) << said;
  EXPECT_LT(report(out)["seconds"]["optimize"], 2);
}

TEST_F(BurstProgram, ChecksWriteTables) {
  const fs::path out = folder_.path() / "out";
  const std::string said = run(photograph(90, 80), out, {"--frames", "3", "--check-stability"});
  EXPECT_NE(said.find("horizon through the frames"), std::string::npos) << said;
  EXPECT_TRUE(fs::exists(out / "report.json"));
}

}  // namespace
