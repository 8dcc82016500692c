// Tests the errors of demosaic for bad input: one line in four parts, status 1, and no file left behind.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "common/images.h"
#include "support/app_errors.h"

namespace {

namespace fs = std::filesystem;

struct DemosaicErrors : AppErrors {
  DemosaicErrors() : AppErrors("demosaic", DEMOSAIC_PROGRAM) {}
};

TEST_F(DemosaicErrors, MissingAndDamagedPictures) { expect_refuses_damaged_pictures(); }

TEST_F(DemosaicErrors, PicturesOfOnePixelOrNoNumbers) {
  expect_refuses_nan(8);
  refused_input(write_noise("dot.png", 1, 1), {"dot.png", "2 x 2 pixels", "it has 1 x 1"});
  refused_input(write_noise("line.png", 9, 1), {"line.png", "it has 9 x 1"});
}

TEST_F(DemosaicErrors, AMosaicNeedsOneChannelAndAPattern) {
  const fs::path colour = write_noise("colour.png", 8, 8);
  refused_input(colour, {"colour.png"}, {"--mosaic", "RGGB"});
  refused_input(colour, {"--mosaic is \"RGBG\"", "Give one of these"}, {"--mosaic", "RGBG"});
}

TEST_F(DemosaicErrors, ShapesThatDoNotExist) {
  const fs::path in = write_noise("in.png", 8, 8);
  refused_input(in, {"2, 9 or 15 filters", "--filters is 4"}, {"--filters", "4"});
  refused_input(in, {"5 x 5 or 7 x 7", "--size is 6"}, {"--size", "6"});
  refused_input(in, {"--optimize"}, {"--optimize", "everything"});
  refused_input(in, {"--steps", "must lie between"}, {"--steps", "0"});
  refused({"--output", out()}, {"neither --input nor --dataset", "Give one of them"});
}

TEST_F(DemosaicErrors, WeightsThatAreNone) {
  const fs::path in = write_noise("in.png", 8, 8);
  refused_input(in, {"nothing.json", "no such file can be read"},
                {"--weights", folder_ / "nothing.json"});
  std::ofstream(folder_ / "half.json") << R"({"filters": 2, "size": 5, "green": [1, 2)";
  refused_input(in, {"half.json", "every array whole"}, {"--weights", folder_ / "half.json"});
  std::ofstream(folder_ / "few.json") << R"({"filters": 2, "size": 5, "green": [1, 2]})";
  refused_input(in, {"few.json", "green has 2 numbers"}, {"--weights", folder_ / "few.json"});
}

TEST_F(DemosaicErrors, FoldersThatNothingCanBeLearnedFrom) {
  refused({"--dataset", folder_ / "none", "--output", out()}, {"none"});
  fs::create_directory(folder_ / "set");
  write_noise("set/only.png", 40, 40);
  refused({"--dataset", folder_ / "set", "--output", out()}, {"two at least", "Add photographs"});
  std::ofstream(folder_ / "set" / "photographs.txt") << "learn only.png\n";
  refused({"--dataset", folder_ / "set", "--output", out()},
          {"photographs.txt", "it has the line \"learn only.png\""});
}

TEST_F(DemosaicErrors, NothingToResumeFrom) {
  fs::create_directory(folder_ / "set");
  write_noise("set/a.png", 40, 40);
  write_noise("set/b.png", 40, 40);
  refused({"--dataset", folder_ / "set", "--output", out(), "--resume", "--filters", "2"},
          {"state.bin", "Run without --resume"});
}

TEST_F(DemosaicErrors, AFolderThatCannotBeWrittenTo) {
  expect_refuses_outputs(write_noise("in.png", 8, 8));
}

}  // namespace
