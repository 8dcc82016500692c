// Tests the errors of fluid for bad input: one line in four parts, status 1, and no result left behind.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>

#include "common/images.h"
#include "support/app_errors.h"

namespace {

namespace fs = std::filesystem;

struct FluidErrors : AppErrors {
  FluidErrors() : AppErrors("fluid", FLUID_PROGRAM) {}

  void SetUp() override { picture_ = write_picture("picture.png", 12, 10); }

  fs::path write_picture(const std::string& name, int width, int height, float brightness = 1) {
    apps::Image image{width, height, 8, {}};
    for (long n = 0; n < image.elems(); ++n) {
      image.pixels.push_back(brightness * static_cast<float>(n * 37 % 101) / 100.0f);
    }
    apps::write_image(folder_ / name, image);
    return folder_ / name;
  }

  void run_on(const fs::path& input, const std::string& more = "") {
    run("--input " + input.string() + " --output " + out().string() + " " + more);
  }

  fs::path picture_;
};

TEST_F(FluidErrors, AMissingPictureIsNamed) {
  run_on(folder_ / "nowhere.png");
  expect_refused({"nowhere.png", "must be an image file", "Give the name of"});
  expect_no_results();
}

TEST_F(FluidErrors, ATruncatedPictureIsRefused) {
  const fs::path whole = write_picture("whole.png", 300, 200);
  fs::resize_file(whole, fs::file_size(whole) / 2);
  run_on(whole);
  expect_refused({"whole.png", "must be a whole image", "damaged or truncated"});
  expect_no_results();
}

TEST_F(FluidErrors, APixelIsNoBox) {
  run_on(write_picture("pixel.png", 1, 1));
  expect_refused({"pixel.png", "at least 4 x 4 cells", "1 x 1", "Give a larger picture"});
  expect_no_results();
}

TEST_F(FluidErrors, ABlackPictureHasNoSmoke) {
  run_on(write_picture("black.png", 12, 10, 0));
  expect_refused({"black.png", "there must be smoke", "all of it is black", "negative"});
  run_on(picture_, "--start " + (folder_ / "black.png").string());
  expect_refused({"black.png", "there must be smoke"});
  expect_no_results();
}

TEST_F(FluidErrors, PixelsThatAreNoNumbersAreRefused) {
  apps::Image image{8, 8, 32,
                    std::vector<float>(8 * 8 * 3, std::numeric_limits<float>::quiet_NaN())};
  apps::write_image(folder_ / "nan.exr", image);
  run_on(folder_ / "nan.exr");
  expect_refused({"nan.exr", "must be a finite number", "pixel (0, 0)"});
  expect_no_results();
}

TEST_F(FluidErrors, MoreCellsThanTheMemoryHoldsAreRefusedBeforeAnythingIsMade) {
  run_on(picture_, "--cells 9000 --memory 500");
  expect_refused({"9000", "--memory 500", "one frame must fit", "MB are needed", "fewer --cells"});
  expect_no_results();
}

TEST_F(FluidErrors, TooLittleMemoryForTheProgramIsRefused) {
  run_on(picture_, "--memory 5");
  expect_refused({"--memory 5", "one state must fit", "MB are needed", "Give more --memory"});
  expect_no_results();
}

TEST_F(FluidErrors, TheStartHasTheShapeOfTheEnd) {
  run_on(picture_, "--start " + write_picture("wide.png", 30, 10).string());
  expect_refused({"wide.png", "fills the same box", "30 x 10", "12 x 10", "Resize or crop"});
  expect_no_results();
}

TEST_F(FluidErrors, NothingIsOptimizedByFactorsFromZero) {
  run_on(picture_, "--viscosity 0");
  expect_refused(
      {"optimize the viscosity", "as a logarithm", "--viscosity a small positive number"});
  run_on(picture_, "--diffusion 0 --optimize diffusion");
  expect_refused({"optimize the diffusion", "as a logarithm"});
  expect_no_results();
}

TEST_F(FluidErrors, NamesMustBeKnown) {
  run_on(picture_, "--optimize gravity");
  expect_refused({"gravity", "time_step"});
  run_on(picture_, "--method magic");
  expect_refused({"magic", "lbfgs"});
  run_on(picture_, "--method newton_cg");
  expect_refused({"newton_cg", "Hessian-vector products"});
  run_on(picture_, "--solver guess");
  expect_refused({"guess", "direct or jacobi"});
}

TEST_F(FluidErrors, NumbersMustBeInTheirRanges) {
  for (const char* option : {"--frames 0", "--time-step 0", "--viscosity -1", "--diffusion -2",
                             "--steps 0", "--cells 2", "--rate 0", "--threads 0"}) {
    run_on(picture_, option);
    const std::string name(option, std::string(option).find(' '));
    expect_refused({name, "must lie between", "too small"});
  }
  expect_no_results();
}

TEST_F(FluidErrors, ResumingNeedsAStateOfTheSameScene) {
  run_on(picture_, "--resume");
  expect_refused({"state.bin"});
  fs::create_directories(out());
  std::ofstream(out() / "state.bin") << "this is no state";
  run_on(picture_, "--resume");
  expect_refused({"state.bin"});
  EXPECT_EQ(contents(out() / "state.bin"), "this is no state");
  run_on(picture_, "--force-from " + (out() / "state.bin").string());
  expect_refused({"state.bin"});
}

TEST_F(FluidErrors, ARunGoesOnOnlyWithItsOwnScene) {
  run_on(picture_, "--frames 2 --force-nodes 2 --steps 1");
  ASSERT_EQ(status_, 0) << message_;
  run_on(picture_, "--frames 3 --force-nodes 2 --steps 2 --resume");
  expect_refused({"state.bin", "the scene that it began with", "2 frames", "3 frames"});
}

TEST_F(FluidErrors, TheOutputMustBeAFolder) {
  run("--input " + picture_.string() + " --output " + picture_.string());
  expect_refused({"picture.png", "must be a folder", "Give another --output"});
}

TEST_F(FluidErrors, AnUnwritableFolderIsFoundBeforeTheRun) {
  expect_refuses_unwritable_folder(picture_);
}

TEST_F(FluidErrors, FilesThatMayNotGrowAreNotLeftHalfWritten) {
  // The limit is in blocks of 512 bytes: enough for the trial file, too little for a state.
  run("--frames 4 --force-nodes 0 --steps 1 --input " + picture_.string() + " --output " +
          out().string(),
      "ulimit -f 8;");
  expect_refused({"state.bin", "stored whole or not at all", "Free some space"}, true);
  expect_no_results();
}

}  // namespace
