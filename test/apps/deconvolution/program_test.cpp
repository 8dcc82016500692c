// Runs deconvolution from a photograph or a folder of photographs to pictures, weights and a report. Also tests
// stopping and resuming.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "common/images.h"
#include "common/process.h"
#include "common/stop.h"
#include "deconvolution/checks.h"
#include "deconvolution/learn.h"
#include "deconvolution/one_picture.h"
#include "deconvolution/tune.h"
#include "scenes.h"
#include "support/temporary_folder.h"

namespace {

namespace fs = std::filesystem;
using namespace deconvolution;
using deconvolution_test::scene;
using nlohmann::json;

class DeconvolutionProgram : public testing::Test {
 protected:
  // Writes a scene as a picture.
  fs::path photograph(const std::string& name, int width, int height, int variant = 0) {
    const auto picture = scene(width, height, variant);
    apps::write_image(folder_.path() / name, demosaic::image_of(width, height, 8, picture.planes));
    return folder_.path() / name;
  }
  fs::path photographs() {
    fs::create_directory(folder_.path() / "set");
    for (int k = 0; k < 3; ++k)
      photograph("set/" + std::to_string(k) + ".png", 100 + 2 * k, 102, k);
    return folder_.path() / "set";
  }
  // Options for a run in this process on a small picture; the output folder exists.
  Options of_a_picture() {
    Options options;
    options.common.input = photograph("a.png", 60, 50);
    options.common.output = out();
    options.psf = "disc:2";
    fs::create_directory(out());
    return options;
  }

  void run(const std::vector<std::string>& more) {
    std::vector<std::string> words{DECONVOLUTION_PROGRAM, "--output", out(), "--threads", "2"};
    words.insert(words.end(), more.begin(), more.end());
    const apps::Outcome outcome = apps::run_program(words);
    EXPECT_EQ(outcome.status, 0) << outcome.output;
  }
  json report() const {
    std::ifstream file(out() / "report.json");
    return json::parse(file)["deconvolution"];
  }
  void expect_files(const std::vector<std::string>& names) const {
    for (const std::string& name : names) EXPECT_TRUE(fs::exists(out() / name)) << name;
  }
  fs::path out() const { return folder_.path() / "out"; }

  const TemporaryFolder folder_;
};

TEST_F(DeconvolutionProgram, BlursAPhotographAndMakesItSharp) {
  run({"--input", photograph("a.png", 90, 70), "--psf", "disc:2.5"});
  expect_files({"truth.png", "blurred.png", "psf.png", "original.png", "tuned.png", "result.png",
                "error_vs_time.png"});
  const json own = report();
  EXPECT_GT(own["picture"]["original"], own["picture"]["blurred"]);
  EXPECT_GT(own["picture"]["learned"], own["picture"]["original"]);
  // A disc of this radius has five samples on each side, so two pixels at each border are not observed.
  EXPECT_EQ(own["width"], 86);
  EXPECT_EQ(own["height"], 66);
  EXPECT_EQ(apps::read_image(out() / "result.png").width, 86);
}

TEST_F(DeconvolutionProgram, TakesABlurredOneAndAFunctionAsAnImage) {
  apps::Image psf{3, 3, 8, std::vector<float>(27, 0.5f)};
  apps::write_image(folder_.path() / "psf.png", psf);
  run({"--input", photograph("a.png", 41, 33), "--psf", folder_.path() / "psf.png", "--blurred",
       "--brief"});
  expect_files({"blurred.png", "result.png"});
  EXPECT_FALSE(fs::exists(out() / "truth.png"));
  EXPECT_EQ(apps::read_image(out() / "result.png").width, 41);
  EXPECT_FALSE(report().contains("picture"));
}

TEST_F(DeconvolutionProgram, PicturesOfFloatsStayFloats) {
  apps::Image image{40, 36, 32, {}};
  for (int k = 0; k < 40 * 36 * 3; ++k)
    image.pixels.push_back(0.2f + 0.3f * static_cast<float>(k / 60 % 2));
  apps::write_image(folder_.path() / "light.exr", image);
  run({"--input", folder_.path() / "light.exr", "--psf", "disc:1.5", "--brief"});
  const apps::Image result = apps::read_image(out() / "result.exr");
  EXPECT_EQ(result.bits, 32);
  EXPECT_NEAR(result.pixels[3 * (17 * 38 + 19)], 0.35, 0.2);
}

TEST_F(DeconvolutionProgram, LearnsAndMeasures) {
  run({"--dataset", photographs(), "--filters", "5", "--size", "3", "--bumps", "2", "--stages", "2",
       "--steps", "4", "--brief"});
  expect_files({"weights.json", "state.bin", "error_vs_time.png", "psnr_vs_time.png"});
  EXPECT_EQ(read_weights(out() / "weights.json").stages, 2);
  json own = report();
  EXPECT_GT(own["held_out"]["learned, 4 steps"], own["held_out"]["blurred"]);
  EXPECT_EQ(own["refused_steps"], 0);
}

TEST_F(DeconvolutionProgram, GoesOnAndStopsWithWhatItHas) {
  Options options;
  options.common.output = out();
  options.common.steps = 3;
  options.shape = {.filters = 2, .size = 3, .bumps = 1};
  options.stages = 1;
  fs::create_directory(out());
  const demosaic::Dataset dataset{{scene(90, 90)}, {scene(80, 80, 1)}, ""};
  const Gallery gallery(dataset.held_out, 0.01, 40);
  apps::Report report("deconvolution", options.common);
  EXPECT_EQ(learn(options, dataset, gallery, report).steps, 3);
  options.common.steps = 50;
  options.common.resume = true;
  apps::request_stop();
  const Learned learned = learn(options, dataset, gallery, report);
  apps::request_stop(false);
  EXPECT_TRUE(learned.stopped);
  EXPECT_EQ(learned.steps, 3);
  EXPECT_TRUE(learned.held_out.each_db.empty());
  EXPECT_TRUE(fs::exists(out() / "weights.json"));
}

TEST_F(DeconvolutionProgram, LeavesThePictureThatItHas) {
  const Options options = of_a_picture();
  apps::Report report("deconvolution", options.common);
  apps::request_stop();
  const std::vector<Method> methods{{"original", original()}, {"again", original()}};
  EXPECT_EQ(deconvolve_input(options, methods, report), 0);
  EXPECT_EQ(apps::read_image(out() / "result.png").width, 56);
  apps::request_stop(false);
  EXPECT_FALSE(fs::exists(out() / "again.png"));
}

// One channel of a picture.
std::vector<float> plane_of(const apps::Image& image, size_t c) {
  std::vector<float> plane;
  for (size_t k = c; k < image.pixels.size(); k += 3) plane.push_back(image.pixels[k]);
  return plane;
}

TEST_F(DeconvolutionProgram, StopsBeforeTheNextIterationWithTheBestOfEachChannel) {
  const Options options = of_a_picture();
  const std::vector<Method> methods{{"original", original()}, {"other", original({.mix = 0.5})}};
  const auto picture = [&](const std::string& name) { return apps::read_image(out() / name); };
  apps::Report whole("deconvolution", options.common), first("deconvolution", options.common),
      second("deconvolution", options.common);
  const long all = deconvolve_input(options, methods, whole);
  EXPECT_EQ(all, 2 * 3 * 2 * options.iterations);
  const apps::Image by_original = picture("original.png"), by_other = picture("result.png");

  int heard = 0;
  const auto stop_at = [&](const std::string& method, size_t c, int iterations) {
    return [=, &heard](const std::string& now, size_t channel, int count) {
      if (apps::stop_requested()) ++heard;
      if (now == method && channel == c && count == iterations) apps::request_stop();
    };
  };
  // Stops at green of the second method: red is the second method's result, the other channels are still the first
  // one's.
  const long half = deconvolve_input(options, methods, second, stop_at("other", 1, 3));
  apps::request_stop(false);
  EXPECT_EQ(heard, 0);
  EXPECT_EQ(half, all / 2 + 2 * options.iterations + 3);
  EXPECT_EQ(plane_of(picture("result.png"), 0), plane_of(by_other, 0));
  EXPECT_EQ(plane_of(picture("result.png"), 1), plane_of(by_original, 1));
  EXPECT_EQ(plane_of(picture("result.png"), 2), plane_of(by_original, 2));
  EXPECT_FALSE(second.own["seconds"].contains("other"));
  EXPECT_EQ(second.own["picture"]["original"], whole.own["picture"]["original"]);
  EXPECT_GT(second.own["picture"]["best so far"], second.own["picture"]["blurred"]);

  // Stops at green of the first method: green is a partial result, and blue is still blurred.
  fs::remove(out() / "original.png");
  deconvolve_input(options, methods, first, stop_at("original", 1, 3));
  apps::request_stop(false);
  EXPECT_EQ(heard, 0);
  EXPECT_FALSE(fs::exists(out() / "original.png"));
  EXPECT_EQ(plane_of(picture("result.png"), 0), plane_of(by_original, 0));
  EXPECT_NE(plane_of(picture("result.png"), 1), plane_of(picture("blurred.png"), 1));
  EXPECT_EQ(plane_of(picture("result.png"), 2), plane_of(picture("blurred.png"), 2));
  EXPECT_GT(first.own["picture"]["best so far"], first.own["picture"]["blurred"]);
}

TEST_F(DeconvolutionProgram, ChecksItself) {
  // The table of inexact solutions gets few numbers, because the test does not depend on them.
  const fs::path weights = folder_.path() / "weights.json";
  write_weights(weights, learning_start({.filters = 6, .size = 3, .bumps = 4}, 2), "a test");
  run({"--input", photograph("a.png", 60, 50), "--check-gradients", "--weights", weights});
  EXPECT_TRUE(fs::exists(out() / "report.json"));
}

TEST_F(DeconvolutionProgram, SurvivesExtremes) {
  // With hardly any noise, float32 is too short for components that the blur almost removes.
  for (const apps::StabilityRow& row : stability_rows(1, 2, 2)) {
    EXPECT_LT(row.primal_error, 0.1) << row.name;
    EXPECT_FALSE(std::isnan(row.gradient_error)) << row.name;
  }
}

TEST(Gallery, LeavesOutWhatSomebodyStopped) {
  const Gallery gallery({scene(60, 60)}, 0.01, 32);
  apps::request_stop();
  EXPECT_TRUE(gallery.measure({{"original", original()}}, 2).empty());
  Deconvolver method({"original", original()}, gallery.extent(), 2);
  EXPECT_FALSE(gallery.measure(method).has_value());
  apps::request_stop(false);
  EXPECT_TRUE(gallery.measure(method).has_value());
}

TEST(Gallery, MeasuresOnTheMiddleOfEachPhotograph) {
  const Gallery gallery({scene(80, 90), scene(100, 70, 1)}, 0.01, 256);
  EXPECT_EQ(gallery.extent().width, 70 - 18);
  EXPECT_EQ(gallery.extent().count, 4);
  const Measured measured = gallery.measure({{"original", original()}}, 2).front();
  EXPECT_GT(measured.mean_db, gallery.blurred_db());
  EXPECT_EQ(measured.stages_db.size(), 2u);
  EXPECT_EQ(measured.stages_db.back(), measured.mean_db);
  const apps::Table table = table_of(gallery.blurred_db(), {measured});
  EXPECT_EQ(table.rows.size(), 2u);
  EXPECT_EQ(details_of(gallery, {measured}).rows.size(), 2u + 4u);
}

}  // namespace
