// Tests the errors of burst_superresolution for unusable inputs: one line in four parts, status 1, no results.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <limits>

#include "common/images.h"
#include "support/app_errors.h"

namespace {

namespace fs = std::filesystem;

class BurstErrors : public AppErrors {
 protected:
  BurstErrors() : AppErrors("burst_superresolution", BURST_PROGRAM) {}

  void refused(const fs::path& input, const std::vector<std::string>& parts,
               const std::string& more = "") {
    run("--input " + input.string() + " --output " + out().string() + " " + more);
    expect_refused(parts);
    expect_no_results();
  }
};

TEST_F(BurstErrors, MissingAndDamagedFiles) { expect_refuses_damaged_pictures(); }

TEST_F(BurstErrors, PhotographsTooSmallToMoveIn) {
  refused(write_noise("dot.png", 1, 1), {"dot.png", "2 x 2 pixels", "it has 1 x 1"});
  refused(write_noise("small.png", 40, 40), {"small.png", "a border of", "40 x 40"});
}

TEST_F(BurstErrors, NoNumbers) {
  apps::Image image{80, 80, 32, {}};
  image.pixels.assign(static_cast<size_t>(image.elems()), std::numeric_limits<float>::quiet_NaN());
  apps::write_image(folder_ / "nan.exr", image);
  refused(folder_ / "nan.exr", {"nan.exr", "every sample must be a finite number"});
}

TEST_F(BurstErrors, HugePhotographs) {
  // The header promises 30000 x 30000 pixels, but the file has none.
  std::ofstream(folder_ / "huge.ppm") << "P6\n30000 30000\n255\n";
  refused(folder_ / "huge.ppm", {"huge.ppm", "50000000 pixels"});
}

TEST_F(BurstErrors, FoldersWithoutFrames) {
  fs::create_directory(folder_ / "empty");
  refused(folder_ / "empty", {"empty", "a folder with images in it"});
  write_noise("colour/a.png", 32, 32);
  refused(folder_ / "colour", {"a.png", "a mosaic has one channel"}, "--mosaic RGGB");
  write_noise("gray/a.png", 32, 32, 1);
  refused(folder_ / "gray", {"a.png", "the file does not say with which", "--mosaic"});
  refused(folder_ / "gray", {"RGBG"}, "--mosaic RGBG");
}

TEST_F(BurstErrors, FramesThatDoNotFit) {
  write_noise("two/a.png", 40, 32, 1);
  write_noise("two/b.png", 42, 32, 1);
  refused(folder_ / "two", {"b.png", "of one size", "42 x 32", "40 x 32"}, "--mosaic RGGB");
  write_noise("dots/a.png", 1, 1, 1);
  refused(folder_ / "dots", {"a.png", "2 x 2 samples"}, "--mosaic RGGB");
  write_noise("few/a.png", 17, 15, 1);
  refused(folder_ / "few", {"a.png", "16 x 16 samples", "16 x 14"}, "--mosaic RGGB");
}

TEST_F(BurstErrors, OptionsOutOfRange) {
  const fs::path in = write_noise("in.png", 120, 120);
  refused(in, {"--frames", "between 1 and 1000"}, "--frames 0");
  refused(in, {"--noise", "between 0 and 1"}, "--noise -0.1");
  refused(in, {"--lambda"}, "--lambda -1");
  refused(in, {"--optimize", "lens"}, "--optimize lens");
  refused(in, {"smooth the colours \"green\"", "rgb or opponent"}, "--colours green");
  refused(in, {"--steps"}, "--steps 0");
}

TEST_F(BurstErrors, NothingToResumeFrom) {
  refused(write_noise("in.png", 120, 120), {"state.bin", "Run without --resume"},
          "--frames 2 --resume");
}

TEST_F(BurstErrors, AFolderThatCannotBeWrittenTo) {
  const fs::path in = write_noise("in.png", 120, 120);
  run("--input " + in.string() + " --output " + in.string());
  expect_refused({"in.png", "must be a folder"});
  run("--input " + in.string() + " --output /proc");
  expect_refused({"/proc"});
}

}  // namespace
