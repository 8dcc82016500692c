// Tests the errors of deconvolution for bad input: one line in four parts, status 1, and no file left behind.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "common/images.h"
#include "support/app_errors.h"

namespace {

namespace fs = std::filesystem;

struct DeconvolutionErrors : AppErrors {
  DeconvolutionErrors() : AppErrors("deconvolution", DECONVOLUTION_PROGRAM) {}
};

TEST_F(DeconvolutionErrors, MissingAndDamagedPictures) { expect_refuses_damaged_pictures(); }

TEST_F(DeconvolutionErrors, PicturesThatAreTooSmallOrNoNumbers) {
  refused_input(write_noise("dot.png", 1, 1), {"dot.png", "it has 1 x 1"});
  refused_input(write_noise("small.png", 40, 20), {"small.png", "34 pixels", "it has 40 x 20"});
  refused_input(write_noise("tiny.png", 10, 10), {"16 pixels", "it has 10 x 10"}, {"--blurred"});
  expect_refuses_nan(40);
}

// A header that promises more pixels than are allowed, without any pixels after it.
TEST_F(DeconvolutionErrors, HugePictures) {
  std::ofstream(folder_ / "huge.ppm") << "P6\n100000 100000\n255\n";
  refused_input(folder_ / "huge.ppm", {"huge.ppm"});
}

TEST_F(DeconvolutionErrors, FunctionsThatAreNone) {
  const fs::path in = write_noise("in.png", 60, 60);
  refused_input(in, {"\"disc:0\"", "its radius is 0"}, {"--psf", "disc:0"});
  refused_input(in, {"\"disc:x\"", "\"x\" is not a number"}, {"--psf", "disc:x"});
  refused_input(in, {"its size is 8"}, {"--psf", "motion:8"});
  refused_input(in, {"its size is 1e+09"}, {"--psf", "motion:1e9"});
  refused_input(in, {"\"-1\" is not a seed"}, {"--psf", "motion:9:-1"});
  refused_input(in, {"no_file", "must be an image file"}, {"--psf", folder_ / "no_file"});
  apps::Image black{5, 5, 8, std::vector<float>(75, 0.0f)};
  apps::write_image(folder_ / "black.png", black);
  refused_input(in, {"black.png", "all of its samples are 0"}, {"--psf", folder_ / "black.png"});
  refused_input(in, {"large.png", "301 samples along a side"},
                {"--psf", write_noise("large.png", 300, 120)});
  black.bits = 32;
  black.pixels[3] = -1;
  apps::write_image(folder_ / "negative.exr", black);
  refused_input(in, {"it is negative at (1, 0)"}, {"--psf", folder_ / "negative.exr"});
}

TEST_F(DeconvolutionErrors, OptionsThatCannotBe) {
  const fs::path in = write_noise("in.png", 60, 60);
  refused_input(in, {"--noise", "must lie between"}, {"--noise", "0"});
  refused_input(in, {"--size is 4"}, {"--size", "4"});
  refused_input(in, {"--filters"}, {"--filters", "0"});
  refused_input(in, {"--optimize"}, {"--optimize", "everything"});
  refused_input(in, {"there is no --dataset"}, {"--compare"});
  refused_input(in, {"there is no --dataset"}, {"--resume"});
  refused({"--output", out()}, {"neither --input nor --dataset", "Give one of them"});
}

TEST_F(DeconvolutionErrors, WeightsThatAreNone) {
  const fs::path in = write_noise("in.png", 60, 60);
  refused_input(in, {"nothing.json", "no such file can be read"},
                {"--weights", folder_ / "nothing.json"});
  std::ofstream(folder_ / "half.json") << R"({"filters": 2, "size": 3, "bumps": 1, "stages": [)";
  refused_input(in, {"half.json", "every array whole"}, {"--weights", folder_ / "half.json"});
  std::ofstream(folder_ / "few.json")
      << R"({"filters": 2, "size": 3, "bumps": 1, "stages": [{"filters": [1, 2]}]})";
  refused_input(in, {"few.json", "filters has 2 numbers"}, {"--weights", folder_ / "few.json"});
  std::ofstream(folder_ / "many.json")
      << R"({"filters": 2000, "size": 3, "bumps": 1, "stages": [1]})";
  refused_input(in, {"many.json", "2000 filters"}, {"--weights", folder_ / "many.json"});
}

TEST_F(DeconvolutionErrors, FoldersThatNothingCanBeLearnedFrom) {
  refused({"--dataset", folder_ / "none", "--output", out()}, {"none"});
  fs::create_directory(folder_ / "set");
  write_noise("set/a.png", 40, 40);
  refused({"--dataset", folder_ / "set", "--output", out()}, {"two at least", "Add photographs"});
  write_noise("set/b.png", 20, 40);
  refused({"--dataset", folder_ / "set", "--output", out()}, {"b.png", "it has 20 x 40"});
  write_noise("set/b.png", 40, 40);
  refused({"--dataset", folder_ / "set", "--output", out(), "--resume"},
          {"state.bin", "Run without --resume"});
}

TEST_F(DeconvolutionErrors, AFolderThatCannotBeWrittenTo) {
  expect_refuses_outputs(write_noise("in.png", 60, 60));
}

}  // namespace
