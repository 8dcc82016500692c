// Tests demosaic: its pipelines against plain C++, the effect of learning, and the program on small pictures.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>

#include "common/images.h"
#include "common/process.h"
#include "common/stop.h"
#include "demosaic/demosaicker.h"
#include "demosaic/measure.h"
#include "demosaic/photographs.h"
#include "demosaic/reference.h"
#include "demosaic/shipped.h"
#include "demosaic/training.h"
#include "support/temporary_folder.h"

namespace {

namespace fs = std::filesystem;
using namespace demosaic;

// A picture with stripes and edges in several directions and colours, and a little noise.
Photograph picture(int width, int height, unsigned seed = 1) {
  std::mt19937 random(seed);
  Photograph result{"picture", width, height, 8, {}};
  for (int c = 0; c < 3; ++c) {
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const double stripes = std::sin(0.9 * x + 0.4 * y) * std::cos(0.05 * (x - seed) * y);
        const double edge = x + 2 * y > width ? 0.2 : 0.0;
        const double noise = (static_cast<double>(random() % 1000) / 1000 - 0.5) * 0.02;
        result.planes.push_back(
            static_cast<float>(0.4 + 0.25 * stripes + edge * (c + 1) / 2 + noise));
      }
    }
  }
  return result;
}

Weights shaken(const Shape& shape, unsigned seed) {
  Weights weights(shape);
  std::mt19937 random(seed);
  for (float& value : weights.values) {
    value += (static_cast<float>(random() % 1000) / 1000 - 0.5f) * 0.1f;
  }
  return weights;
}

// The number of samples that differ by more than `tolerance`.
size_t differing(const std::vector<float>& got, const std::vector<double>& wanted,
                 double tolerance) {
  EXPECT_EQ(got.size(), wanted.size());
  size_t count = 0;
  for (size_t n = 0; n < wanted.size(); ++n) count += !(std::abs(got[n] - wanted[n]) <= tolerance);
  return count;
}

struct Sized {
  int width, height;
};
constexpr Sized sizes[] = {{37, 22}, {16, 16}, {3, 5}, {2, 2}, {64, 2}};

TEST(DemosaicPipelines, BilinearIsThatOfPlainLoops) {
  Demosaicker method = Demosaicker::bilinear(2);
  for (const Sized& size : sizes) {
    const Photograph photograph = picture(size.width, size.height);
    auto mosaic = mosaic_of(photograph);
    const auto wanted = reference::bilinear({size.width, size.height, mosaic});
    EXPECT_EQ(differing(method.run(mosaic, size.width, size.height), wanted, 1e-6), 0u)
        << size.width << " x " << size.height;
  }
}

// Rounding may change a homogeneity count by one, so a few pixels may differ. In 2 x 2 pixels all may differ, because
// mirroring makes a texture of ties.
TEST(DemosaicPipelines, AhdIsThatOfPlainLoops) {
  Demosaicker method = Demosaicker::ahd(2);
  for (const Sized& size : sizes) {
    if (size.width * size.height < 10) continue;
    const Photograph photograph = picture(size.width, size.height);
    auto mosaic = mosaic_of(photograph);
    const auto wanted = reference::ahd({size.width, size.height, mosaic});
    EXPECT_LE(differing(method.run(mosaic, size.width, size.height), wanted, 1e-5),
              wanted.size() / 50)
        << size.width << " x " << size.height;
  }
}

TEST(DemosaicPipelines, TheRelaxedMethodIsThatOfPlainLoops) {
  for (const Shape& shape : {Shape{2, 5}, Shape{3, 7}}) {
    const Weights weights = shaken(shape, 7);
    Demosaicker method = Demosaicker::relaxed(weights, 2);
    for (const Sized& size : sizes) {
      const Photograph photograph = picture(size.width, size.height);
      auto mosaic = mosaic_of(photograph);
      const auto wanted = reference::relaxed({size.width, size.height, mosaic}, weights);
      EXPECT_EQ(differing(method.run(mosaic, size.width, size.height), wanted, 1e-4), 0u)
          << name_of(shape) << " on " << size.width << " x " << size.height;
    }
  }
}

TEST(DemosaicPipelines, WhatWasMeasuredStays) {
  const Photograph photograph = picture(30, 26);
  auto mosaic = mosaic_of(photograph);
  for (Demosaicker method :
       {Demosaicker::bilinear(1), Demosaicker::ahd(1), Demosaicker::relaxed(Weights({2, 5}), 1)}) {
    const auto planes = method.run(mosaic, 30, 26);
    for (int y = 0; y < 26; ++y) {
      for (int x = 0; x < 30; ++x) {
        const size_t n = static_cast<size_t>(y) * 30 + static_cast<size_t>(x);
        const size_t c = static_cast<size_t>(colour_at(x, y));
        EXPECT_FLOAT_EQ(planes[c * 780 + n], mosaic[n]) << method.name();
      }
    }
  }
}

TEST(DemosaicPipelines, AFlatGrayFrameStaysItself) {
  for (Demosaicker method :
       {Demosaicker::bilinear(1), Demosaicker::ahd(1), Demosaicker::relaxed(Weights({9, 5}), 1)}) {
    for (const float level : {0.0f, 0.5f, 1.0f}) {
      std::vector<float> mosaic(24 * 20, level);
      for (float value : method.run(mosaic, 24, 20)) {
        ASSERT_NEAR(value, level, 2e-6) << method.name();
      }
    }
  }
}

// Rows alternate in gray: interpolation along them makes no error, interpolation across them does.
TEST(DemosaicPipelines, AhdFollowsStripesWhereBilinearBlursThem) {
  Photograph stripes{"stripes", 40, 40, 8, {}};
  for (int n = 0; n < 3 * 1600; ++n) {
    stripes.planes.push_back(n / 40 % 40 / 2 % 2 == 0 ? 0.2f : 0.7f);
  }
  auto mosaic = mosaic_of(stripes);
  Demosaicker bilinear = Demosaicker::bilinear(1), ahd = Demosaicker::ahd(1);
  const double blurred = quality(stripes, bilinear.run(mosaic, 40, 40)).encoded_db;
  EXPECT_GT(quality(stripes, ahd.run(mosaic, 40, 40)).encoded_db, blurred + 10);
}

TEST(DemosaicQuality, IsTheUsualDecibels) {
  Photograph truth{"flat", 4, 4, 8, std::vector<float>(48, 0.5f)};
  std::vector<float> other(48, 0.6f);
  const Quality q = quality(truth, other);
  EXPECT_NEAR(q.encoded_db, 20, 1e-4);
  EXPECT_NEAR(q.linear_db, -20 * std::log10(decoded(0.6f) - decoded(0.5f)), 1e-4);
}

TEST(DemosaicWeights, AreKeptInAFile) {
  const TemporaryFolder folder;
  Weights weights = shaken({9, 7}, 3);
  write_weights(folder.path() / "w.json", weights, "a test");
  const Weights read = read_weights(folder.path() / "w.json");
  ASSERT_EQ(read.shape, weights.shape);
  ASSERT_EQ(read.values.size(), weights.values.size());
  for (size_t n = 0; n < read.values.size(); ++n) {
    EXPECT_NEAR(read.values[n], weights.values[n], 1e-6 + 1e-5 * std::abs(weights.values[n]));
  }
}

// All weights are finite, and arrays are complete, as read_weights() requires, under the name of their shape.
TEST(DemosaicWeights, EveryShippedFileLoads) {
  size_t files = 0;
  for (const auto& entry : fs::directory_iterator(DEMOSAIC_WEIGHTS)) {
    const Shape shape = read_weights(entry.path()).shape;
    EXPECT_EQ(entry.path().filename().string(), weights_file(shape));
    ++files;
  }
  EXPECT_EQ(files, 6u) << "2, 9 and 15 filters, of 5 x 5 and 7 x 7";
}

class DemosaicLearning : public testing::Test {
 protected:
  Trainer::Options options(int threads = 2) const {
    apps::CommonOptions common;
    common.steps = 40;
    common.threads = threads;
    common.seed = 5;
    common.optimize = group_names;
    return {.common = common, .batch = {.cells = 8, .pieces = 2}};
  }
  std::vector<float> after(int steps, const Trainer::Options& options) const {
    Trainer trainer(Weights({2, 5}), photographs_, options);
    for (int step = 0; step < steps; ++step) trainer.step();
    return trainer.weights().values;
  }

  const std::vector<Photograph> photographs_{picture(60, 50, 1), picture(70, 64, 2)};
};

TEST_F(DemosaicLearning, LowersTheErrorOnThePhotographsLearnedFrom) {
  Gallery gallery(photographs_);
  const Weights start({2, 5});
  Demosaicker method = Demosaicker::relaxed(start, 2);
  const double before = gallery.quality_of(method).mean.encoded_db;
  Trainer trainer(start, photographs_, options());
  for (int step = 0; step < 40; ++step) trainer.step();
  method.use(trainer.weights());
  EXPECT_GT(gallery.quality_of(method).mean.encoded_db, before + 0.5);
}

TEST_F(DemosaicLearning, DoesNotDependOnTheThreads) {
  EXPECT_EQ(after(3, options(1)), after(3, options(2)));
}

TEST_F(DemosaicLearning, GoesOnFromAStateAsIfItHadNotStopped) {
  Trainer first(Weights({2, 5}), photographs_, options());
  for (int step = 0; step < 5; ++step) first.step();
  apps::State state{.program = "demosaic"};
  first.save(state);
  Trainer second(Weights({2, 5}), photographs_, options());
  second.restore(state);
  for (int step = 0; step < 5; ++step) second.step();
  EXPECT_EQ(second.weights().values, after(10, options()));
}

TEST_F(DemosaicLearning, MovesOnlyTheGroupsThatItIsTold) {
  auto chosen = options();
  chosen.common.optimize = {"chroma"};
  Weights moved({2, 5}), start({2, 5});
  moved.values = after(3, chosen);
  for (Array array : all_arrays) {
    const auto a = start.of(array), b = moved.of(array);
    const bool same = std::equal(a.begin(), a.end(), b.begin());
    EXPECT_EQ(same, group_of(array) != "chroma") << static_cast<int>(array);
  }
}

// Gradients by groups that are not learned are not part of the program.
TEST_F(DemosaicLearning, ComputesOnlyWhatItsGroupsNeed) {
  const auto chosen = options();
  const TrainingPipeline all({2, 5}, chosen.batch, group_names);
  const TrainingPipeline some({2, 5}, chosen.batch, {"chroma"});
  EXPECT_LT(some.stages(), all.stages() - 5);
}

class DemosaicProgram : public testing::Test {
 protected:
  fs::path write(const std::string& name, const Photograph& photograph) {
    apps::write_image(folder_ / name,
                      image_of(photograph.width, photograph.height, 8, photograph.planes));
    return folder_ / name;
  }

  // Writes a sensor's view of the photograph in one channel. Given such a file, the program runs the relaxed method
  // alone.
  fs::path write_mosaic(const std::string& name, const Photograph& photograph) {
    apps::write_image(folder_ / name,
                      {photograph.width, photograph.height, 8, mosaic_of(photograph), 1});
    return folder_ / name;
  }

  // Writes the initial weights, before any learning.
  fs::path start() {
    Weights weights({2, 5});
    write_weights(folder_ / "start.json", weights, "the start");
    return folder_ / "start.json";
  }

  nlohmann::json run(std::vector<std::string> words) {
    words.insert(words.begin(), {DEMOSAIC_PROGRAM, "--threads", "2", "--output", out().string()});
    const apps::Outcome outcome = apps::run_program(words);
    EXPECT_EQ(outcome.status, 0) << outcome.output;
    output_ = outcome.output;
    std::ifstream file(out() / "report.json");
    return file ? nlohmann::json::parse(file) : nlohmann::json();
  }

  fs::path out() const { return folder_ / "out"; }

  const TemporaryFolder temporary_;
  const fs::path& folder_ = temporary_.path();
  std::string output_;
};

TEST_F(DemosaicProgram, DemosaicsAPictureInThreeWays) {
  const auto report = run({"--input", write("in.png", picture(50, 41)), "--weights", start()});
  EXPECT_EQ(report["demosaic"]["width"], 50);
  EXPECT_EQ(report["demosaic"]["picture"].size(), 3u);
  for (const char* name : {"truth.png", "mosaic.png", "bilinear.png", "ahd.png", "result.png"}) {
    const apps::Image image = apps::read_image(out() / name);
    EXPECT_EQ(image.width, 50) << name;
    EXPECT_EQ(image.height, 41) << name;
  }
}

class DemosaicShapes : public DemosaicProgram,
                       public testing::WithParamInterface<std::pair<std::string, std::string>> {};

TEST_P(DemosaicShapes, TakeTheirShippedWeights) {
  const auto& [filters, size] = GetParam();
  const fs::path in = write_mosaic("in.png", picture(40, 40));
  const auto report =
      run({"--input", in, "--mosaic", "RGGB", "--filters", filters, "--size", size});
  const std::string name = "relaxed " + filters + " " + size + "x" + size;
  EXPECT_EQ(report["pictures"].at(0).at("caption"), name) << report["pictures"].dump();
}

INSTANTIATE_TEST_SUITE_P(Shipped, DemosaicShapes,
                         testing::Values(std::pair{"2", "7"}, std::pair{"15", "5"}));

// The same scene behind each of the four mosaics must give the same colours, also in odd sizes.
TEST_F(DemosaicProgram, KnowsTheFourMosaics) {
  const int width = 33, height = 27;
  for (const std::string pattern : {"RGGB", "GRBG", "GBRG", "BGGR"}) {
    apps::Image mosaic{width, height, 8, {}, 1};
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const char colour = pattern[static_cast<size_t>((x & 1) + 2 * (y & 1))];
        mosaic.pixels.push_back(colour == 'R' ? 0.8f : colour == 'G' ? 0.4f : 0.2f);
      }
    }
    apps::write_image(folder_ / "mosaic.png", mosaic);
    run({"--input", folder_ / "mosaic.png", "--mosaic", pattern, "--weights", start()});
    const apps::Image result = apps::read_image(out() / "result.png");
    ASSERT_EQ(result.width, width);
    ASSERT_EQ(result.height, height);
    for (size_t n = 0; n < result.pixels.size(); ++n) {
      const float wanted[] = {0.8f, 0.4f, 0.2f};
      ASSERT_NEAR(result.pixels[n], wanted[n % 3], 0.02) << pattern << " at " << n / 3;
    }
  }
}

TEST_F(DemosaicProgram, LearnsAndReports) {
  fs::create_directory(folder_ / "set");
  for (unsigned n = 0; n < 3; ++n) {
    write(retrograde::text("set/", n, ".png"), picture(130, 130, n));
  }
  const std::vector<std::string> words{"--dataset", folder_ / "set", "--filters", "2",
                                       "--brief",   "--steps",       "6"};
  const auto report = run(words);
  EXPECT_EQ(report["steps"], 6);
  EXPECT_EQ(report["demosaic"]["methods"].size(), 3u);
  for (const char* name : {"error_vs_time.png", "quality_vs_time.png", "psnr_vs_time.png",
                           "weights.json", "state.bin"}) {
    EXPECT_TRUE(fs::exists(out() / name)) << name;
  }
  const Weights learned = read_weights(out() / "weights.json");
  EXPECT_NE(learned.values, Weights({2, 5}).values);
}

TEST_F(DemosaicProgram, ChecksGradients) {
  run({"--input", write("in.png", picture(40, 40)), "--filters", "2", "--check-gradients"});
  EXPECT_NE(output_.find("| steepness |"), std::string::npos) << output_;
}

TEST_F(DemosaicProgram, ChecksStability) {
  run({"--input", write("in.png", picture(40, 40)), "--filters", "2", "--check-stability"});
  EXPECT_NE(output_.find("| saturated |"), std::string::npos) << output_;
}

TEST_F(DemosaicProgram, SaysWhatItLeftOut) {
  run({"--input", write_mosaic("in.png", picture(40, 40)), "--mosaic", "RGGB", "--weights", start(),
       "--filters", "2", "--optimize", "chroma", "--explain"});
  EXPECT_NE(output_.find("left out: the gradient by green"), std::string::npos) << output_;
}

}  // namespace
