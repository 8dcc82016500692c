// Image files that programs with RunGenMain read and write.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <string>

#include "run_gen/filter.h"
#include "run_gen/image_files.h"
#include "support/temporary_folder.h"

namespace retrograde::run_gen {
namespace {

const halide_type_t bytes(halide_type_uint, 8), floats(halide_type_float, 32);

// Smooth, so that JPEG preserves it.
Image picture(int width, int height, int channels) {
  auto image = Halide::Runtime::Buffer<uint8_t>(width, height, channels);
  image.for_each_element([&](int x, int y, int c) {
    image(x, y, c) = static_cast<uint8_t>(20 + 3 * x + 2 * y + 10 * c);
  });
  return image;
}

int largest_difference(const Image& a, const Image& b) {
  int result = 0;
  const auto &u = a.as<const uint8_t>(), &v = b.as<const uint8_t>();
  u.for_each_element([&](const int* at) { result = std::max(result, std::abs(u(at) - v(at))); });
  return result;
}

class RunGenFiles : public ::testing::TestWithParam<const char*> {
 protected:
  std::string path() const { return (folder_.path() / (std::string("it.") + GetParam())).string(); }
  int tolerance() const { return *GetParam() == 'j' ? 6 : 0; }
  std::string error_of_reading() const {
    try {
      read_image(path(), bytes, 3);
    } catch (const Problem& problem) {
      return problem.what();
    }
    return "no error";
  }
  TemporaryFolder folder_;
};

TEST_P(RunGenFiles, PicturesComeBack) {
  for (int channels : {1, 3}) {
    const Image drawn = picture(37, 21, channels);
    write_image(path(), drawn);
    const Image read = read_image(path(), bytes, 3);
    ASSERT_EQ(read.dim(0).extent(), 37);
    ASSERT_EQ(read.dim(1).extent(), 21);
    ASSERT_EQ(read.dim(2).extent(), channels);
    EXPECT_LE(largest_difference(drawn, read), tolerance());
  }
}

TEST_P(RunGenFiles, FloatsAreFractionsOfOne) {
  write_image(path(), picture(16, 8, 3));
  const Image read = read_image(path(), floats, 3);
  EXPECT_NEAR(read.as<const float>()(5, 4, 1), (20 + 15 + 8 + 10) / 255.0f,
              tolerance() / 255.0f + 1e-6f);
  write_image(path(), read);
  EXPECT_LE(largest_difference(picture(16, 8, 3), read_image(path(), bytes, 3)), 2 * tolerance());
}

TEST_P(RunGenFiles, WhatIsNoPictureIsRefused) {
  EXPECT_NE(error_of_reading().find("cannot be read"), std::string::npos) << error_of_reading();
  std::ofstream(path()) << "this is no picture";
  EXPECT_NE(error_of_reading().find("cannot be read: "), std::string::npos) << error_of_reading();
  std::ofstream(path()).close();
  EXPECT_NE(error_of_reading().find("cannot be read"), std::string::npos) << error_of_reading();
  EXPECT_THROW(write_image(path(), picture(4, 4, 5)), Problem);
  EXPECT_THROW(write_image(path() + ".nowhere/it.jpg", picture(4, 4, 1)), Problem);
}

TEST_P(RunGenFiles, CutOffFilesAreRefused) {
  write_image(path(), picture(64, 64, 3));
  std::string all;
  {
    std::ifstream in(path(), std::ios::binary);
    all.assign(std::istreambuf_iterator<char>(in), {});
  }
  for (size_t kept : {size_t{10}, all.size() / 4, all.size() / 2, all.size() - 20}) {
    std::ofstream(path(), std::ios::binary) << all.substr(0, kept);
    EXPECT_NE(error_of_reading().find("cannot be read: "), std::string::npos)
        << kept << " bytes: " << error_of_reading();
  }
}

// A function of an image that reads nothing; it is called only in bounds queries.
TEST(RunGenShapes, WithTooManyElementsAreRefused) {
  halide_filter_argument_t arguments[2] = {};
  arguments[0].name = "in", arguments[0].kind = halide_argument_kind_input_buffer;
  arguments[1].name = "out", arguments[1].kind = halide_argument_kind_output_buffer;
  for (auto& argument : arguments) argument.dimensions = 3, argument.type = bytes;
  halide_filter_metadata_t metadata = {};
  metadata.num_arguments = 2;
  metadata.arguments = arguments;
  metadata.name = "f";
  const Filter filter{[](void**) { return 0; }, &metadata};
  Options options;
  for (const char* extents : {"[65536,32768,2]", "[50000,50000,1]", "[2147483647,2147483647,1]"}) {
    options.values["in"] = std::string("zero:") + extents;
    try {
      Call(filter, options);
      FAIL() << extents;
    } catch (const Problem& problem) {
      EXPECT_NE(std::string(problem.what()).find("\"in\" would have more than 2147483647"),
                std::string::npos)
          << problem.what();
    }
  }
  options.values["in"] = "zero:[4,3,2]";
  EXPECT_EQ(Call(filter, options).run(), 0);
}

INSTANTIATE_TEST_SUITE_P(Kinds, RunGenFiles, ::testing::Values("png", "jpg", "jpeg"));

}  // namespace
}  // namespace retrograde::run_gen
