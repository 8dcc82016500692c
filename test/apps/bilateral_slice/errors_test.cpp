// Tests the errors of bilateral_slice for bad input: one line in four parts, status 1, and no file left behind.
#include <gtest/gtest.h>
#include <sys/mount.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "common/images.h"
#include "support/app_errors.h"

namespace {

namespace fs = std::filesystem;

struct BilateralSliceErrors : AppErrors {
  BilateralSliceErrors() : AppErrors("bilateral_slice", BILATERAL_SLICE_PROGRAM) {}

  void SetUp() override { photo_ = write_noise("photo.png", 12, 10); }

  void run_on(const fs::path& input, const std::string& more = "") {
    run("--halide-seconds 0 --input " + input.string() + " --output " + out().string() + " " +
        more);
  }

  fs::path photo_;
};

TEST_F(BilateralSliceErrors, DamagedPicturesAreRefused) { expect_refuses_damaged_pictures(); }

TEST_F(BilateralSliceErrors, AFolderIsNoImage) {
  run_on(folder_);
  expect_refused({"must be an image file", "no regular file"});
}

TEST_F(BilateralSliceErrors, AnEmptyFileIsNoImage) {
  std::ofstream(folder_ / "empty.png").close();
  run_on(folder_ / "empty.png");
  expect_refused({"empty.png", "OpenImageIO decodes"});
}

TEST_F(BilateralSliceErrors, ALineOfPixelsIsNoPhoto) {
  run_on(write_noise("line.png", 9, 1));
  expect_refused({"line.png", "at least 4 x 4 pixels", "it has 9 x 1", "Give a larger photo"});
  expect_no_results();
}

TEST_F(BilateralSliceErrors, SizesMustAgree) {
  const fs::path other = write_noise("other.png", 12, 11);
  run_on(photo_, "--target " + other.string());
  expect_refused({"photo.png", "other.png", "must have the same size", "12 x 10", "12 x 11",
                  "Resize or crop"});
  expect_no_results();
}

TEST_F(BilateralSliceErrors, StepsMustBePositive) {
  for (const char* steps : {"0", "-3"}) {
    run_on(photo_, std::string("--steps ") + steps);
    expect_refused({"--steps", steps, "must lie between 1 and", "too small"});
  }
}

TEST_F(BilateralSliceErrors, StepsMustBeANumber) {
  run_on(photo_, "--steps many");
  expect_refused({"understand the command line", "many", "--help"});
}

TEST_F(BilateralSliceErrors, HugeStepsAreRefused) {
  run_on(photo_, "--steps 99999999999999999999");
  expect_refused({"--steps"});
}

TEST_F(BilateralSliceErrors, ThreadsMustBePositive) {
  for (const char* threads : {"0", "-1", "5000"}) {
    run_on(photo_, std::string("--threads ") + threads);
    expect_refused({"--threads", threads, "must lie between 1 and 1024"});
  }
}

TEST_F(BilateralSliceErrors, InputAndOutputAreNeeded) {
  run("--output " + out().string());
  expect_refused({"understand the command line", "either --input or --pairs is required"});
  run("--input " + photo_.string());
  expect_refused({"understand the command line", "--output is required"});
}

TEST_F(BilateralSliceErrors, AFolderTakesThePlaceOfThePhoto) {
  run_on(photo_, "--pairs " + folder_.string());
  expect_refused({"either --input or --pairs is required", "both are given"});
  run("--output " + out().string() + " --pairs " + (folder_ / "nowhere").string());
  expect_refused({"must be a folder with images in it"});
  fs::create_directories(folder_ / "alone");
  fs::copy_file(photo_, folder_ / "alone" / "photo.png");
  run("--output " + out().string() + " --pairs " + (folder_ / "alone").string());
  expect_refused({"some are learned from and others are measured on", "Add photographs"});
  std::ofstream(folder_ / "alone" / "photographs.txt") << "held_out none.png\ntrain photo.png\n";
  run("--output " + out().string() + " --pairs " + (folder_ / "alone").string());
  expect_refused({"none.png", "existing image"});
  expect_no_results();
}

TEST_F(BilateralSliceErrors, OtherFilesAreNoLooks) {
  run_on(photo_, "--apply " + photo_.string());
  expect_refused({"photo.png", "does not begin as a state does"});
  run_on(photo_, "--apply " + (folder_ / "nowhere").string());
  expect_refused({"no such file can be read"});
  expect_no_results();
}

TEST_F(BilateralSliceErrors, ARunThatNeverWasCannotGoOn) {
  run_on(photo_, "--resume");
  expect_refused({"resume from", "state.bin"});
  expect_no_results();
}

TEST_F(BilateralSliceErrors, AGuideMovesOnlyWithAGridThatHasLayers) {
  run_on(photo_, "--optimize mix,curve");
  expect_refused({"learn the guide alone", "all layers of the grid are equal, as in the identity",
                  "Give --start LOOK"});
  run_on(photo_, "--optimize sepia");
  expect_refused({"no \"sepia\" to optimize"});
  run_on(photo_, "--resume --start " + photo_.string());
  expect_refused({"both --resume and --start are given"});
  run_on(photo_, "--optimize mix --start " + photo_.string());
  expect_refused({"photo.png", "does not begin as a state does"});
  expect_no_results();
}

// A run of one step writes a state and a look; the refused runs after it must not change them.
TEST_F(BilateralSliceErrors, OtherGroupsAndChannelsDoNotGoOn) {
  const fs::path gray = write_noise("gray.png", 12, 10, 1);
  run_on(gray, "--steps 1 --grid 4 --optimize grid");
  ASSERT_EQ(status_, 0) << message_;
  run_on(gray, "--steps 2 --grid 4 --resume");
  expect_refused({"the same groups", "the state is of \"grid\"", "of \"grid,mix,curve\"",
                  "Give --optimize as"},
                 true);
  run_on(photo_, "--steps 2 --grid 4 --optimize grid --resume");
  expect_refused({"the same channels", "the state is of \"1\"", "of \"3\""}, true);
  run_on(gray, "--steps 2 --grid 5 --optimize grid --resume");
  expect_refused({"resume with these options", "array0"}, true);
  const std::string look = (out() / "look.bin").string();
  run_on(photo_, "--apply " + look);
  expect_refused(
      {"give the look", "photo.png", "the look has 1, the photo 3", "Make the photo gray"});
  run_on(photo_, "--steps 1 --start " + look);
  expect_refused({"give the look", "the look has 1, the photo 3"});
  fs::create_directories(folder_ / "pairs");
  for (const char* name : {"a.png", "b.png"}) fs::copy_file(photo_, folder_ / "pairs" / name);
  const std::string pairs =
      "--pairs " + (folder_ / "pairs").string() + " --output " + out().string();
  run(pairs + " --start " + look);
  expect_refused({"give the look", "the look has 1, the photo 3"});
  run(pairs + " --resume");
  expect_refused({"resume from", "state.bin"});
}

TEST_F(BilateralSliceErrors, OtherPhotographsDoNotGoOn) {
  fs::create_directories(folder_ / "pairs");
  for (const char* name : {"a.png", "b.png"}) fs::copy_file(photo_, folder_ / "pairs" / name);
  const std::string pairs =
      "--pairs " + (folder_ / "pairs").string() + " --output " + out().string() + " --steps 1";
  run(pairs);
  ASSERT_EQ(status_, 0) << message_;
  fs::rename(folder_ / "pairs" / "a.png", folder_ / "pairs" / "c.png");
  fs::rename(folder_ / "pairs" / "b.png", folder_ / "pairs" / "d.png");
  run(pairs + " --resume");
  expect_refused({"resume with these photographs", "the others stay held out", "--seed"});
}

TEST_F(BilateralSliceErrors, UnknownOptionsAreRefused) {
  run_on(photo_, "--sepia");
  expect_refused({"understand the command line", "--sepia"});
}

TEST_F(BilateralSliceErrors, TheOutputMustBeAFolder) {
  run("--input " + photo_.string() + " --output " + photo_.string());
  expect_refused({"photo.png", "must be a folder", "Give another --output"});
  run("--input " + photo_.string() + " --output " + (photo_ / "deeper").string());
  expect_refused({"must be a folder"});
}

TEST_F(BilateralSliceErrors, AnUnwritableFolderIsFoundBeforeTheRun) {
  expect_refuses_unwritable_folder(photo_);
}

TEST_F(BilateralSliceErrors, AFileThatMayNotGrowIsNotLeftHalfWritten) {
  const fs::path large = write_noise("large.png", 100, 100);
  // The limit is in blocks of 512 bytes: enough for the trial file, too little for an image.
  run("--halide-seconds 0 --steps 1 --input " + large.string() + " --output " + out().string(),
      "ulimit -f 8;");
  expect_refused({"input.png", "stored whole or not at all", "File too large", "Free some space"},
                 true);
  expect_no_results();
}

TEST_F(BilateralSliceErrors, AFullDiskLeavesNothingHalfWritten) {
  fs::create_directories(out());
  if (mount("tmpfs", out().c_str(), "tmpfs", 0, "size=16k") != 0) {
    GTEST_SKIP() << "may not mount a small disk here";
  }
  const fs::path large = write_noise("large.png", 100, 100);
  run_on(large, "--steps 1");
  expect_refused({"input.png", "No space left on device", "Free some space"}, true);
  expect_no_results();
  umount(out().c_str());
}

TEST_F(BilateralSliceErrors, APlotThatCannotBeDrawnIsAnError) {
  run("--halide-seconds 0 --steps 1 --input " + photo_.string() + " --output " + out().string(),
      "RETROGRADE_PYTHON=/bin/false");
  expect_refused({"draw", "error_against_time.png", "status 1", "python3-matplotlib"}, true);
  EXPECT_TRUE(fs::exists(out() / "report.json"));
  EXPECT_FALSE(fs::exists(out() / "error_against_time.png"));
}

}  // namespace
