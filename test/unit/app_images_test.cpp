// Images of every kind come in as RGB floats, and go out as PNG.
#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <limits>

#include "common/files.h"
#include "common/images.h"
#include "diagnostics/error.h"
#include "support/temporary_folder.h"

namespace {

namespace fs = std::filesystem;

void expect_pixels(const apps::Image& image, const std::vector<float>& expected) {
  ASSERT_EQ(image.pixels.size(), expected.size());
  for (size_t n = 0; n < expected.size(); ++n) EXPECT_FLOAT_EQ(image.pixels[n], expected[n]);
}

class AppImages : public testing::Test {
 protected:
  // Sample n of the file is values[n].
  fs::path store(const std::string& name, int width, int height, int channels, OIIO::TypeDesc type,
                 const std::vector<float>& values) {
    const fs::path path = folder_ / name;
    auto output = OIIO::ImageOutput::create(path.string());
    OIIO::ImageSpec spec(width, height, channels, type);
    spec["oiio:UnassociatedAlpha"] = 1;
    EXPECT_TRUE(output && output->open(path.string(), spec) &&
                output->write_image(OIIO::TypeDesc::FLOAT, values.data()) && output->close());
    return path;
  }

  const TemporaryFolder temporary_;
  const fs::path& folder_ = temporary_.path();
};

TEST_F(AppImages, EightBitsSurviveARoundTrip) {
  apps::Image image{5, 3, 8, {}};
  for (long n = 0; n < image.elems(); ++n) {
    image.pixels.push_back(static_cast<float>(n * 11 % 256) / 255.0f);
  }
  apps::write_png(folder_ / "a.png", image);
  const apps::Image back = apps::read_image(folder_ / "a.png");
  EXPECT_EQ(back.width, 5);
  EXPECT_EQ(back.height, 3);
  EXPECT_EQ(back.bits, 8);
  for (long n = 0; n < image.elems(); ++n) EXPECT_FLOAT_EQ(back.pixels[n], image.pixels[n]);
}

TEST_F(AppImages, SixteenBitsSurviveARoundTrip) {
  apps::Image image{4, 2, 16, {}};
  for (long n = 0; n < image.elems(); ++n) {
    image.pixels.push_back(static_cast<float>(n * 2711 % 65536) / 65535.0f);
  }
  apps::write_png(folder_ / "a.png", image);
  const apps::Image back = apps::read_image(folder_ / "a.png");
  EXPECT_EQ(back.bits, 16);
  for (long n = 0; n < image.elems(); ++n) EXPECT_NEAR(back.pixels[n], image.pixels[n], 1e-6);
}

TEST_F(AppImages, FloatsComeAsTheyAre) {
  const auto path = store("a.exr", 2, 1, 3, OIIO::TypeDesc::FLOAT, {0, 0.25f, 3, -1, 0.5f, 1e-6f});
  const apps::Image image = apps::read_image(path);
  EXPECT_EQ(image.bits, 32);
  EXPECT_EQ(image.pixels, (std::vector<float>{0, 0.25f, 3, -1, 0.5f, 1e-6f}));
}

TEST_F(AppImages, GrayIsSpreadOverTheColours) {
  const auto path = store("a.png", 2, 1, 1, OIIO::TypeDesc::UINT8, {0.2f, 1.0f});
  expect_pixels(apps::read_image(path), {0.2f, 0.2f, 0.2f, 1.0f, 1.0f, 1.0f});
}

TEST_F(AppImages, AlphaIsLeftOutAndDoesNotDarken) {
  const auto path = store("a.png", 1, 1, 4, OIIO::TypeDesc::UINT8, {1.0f, 0.6f, 0.2f, 0.4f});
  expect_pixels(apps::read_image(path), {1.0f, 0.6f, 0.2f});
}

TEST_F(AppImages, SamplesAreClampedInPng) {
  apps::write_png(folder_ / "a.png", {1, 1, 8, {-2.0f, 0.0f, 7.0f}});
  EXPECT_EQ(apps::read_image(folder_ / "a.png").pixels, (std::vector<float>{0, 0, 1}));
}

TEST_F(AppImages, TheSuffixSaysHowAnImageIsStored) {
  const apps::Image image{
      3, 2, 32, {0, 0.25f, 0.5f, 0.75f, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14}};
  for (const char* name : {"a.exr", "a.tif", "a.TIFF"}) {
    apps::write_image(folder_ / name, image);
    EXPECT_EQ(apps::read_image(folder_ / name).pixels, image.pixels) << name;
  }
  apps::write_image(folder_ / "a.hdr", image);
  const apps::Image back = apps::read_image(folder_ / "a.hdr");
  for (size_t n = 0; n < image.pixels.size(); ++n)
    EXPECT_NEAR(back.pixels[n], image.pixels[n], 0.1);  // eight bits, shared exponent
  apps::write_image(folder_ / "a.jpg", image);
  EXPECT_EQ(apps::read_image(folder_ / "a.jpg").bits, 8);
  // Nothing else is left in the folder.
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()), 5);
}

TEST_F(AppImages, AnUnknownSuffixIsRefusedBeforeAnythingIsWritten) {
  for (const char* name : {"a.xyz", "a"}) {
    try {
      apps::write_image(folder_ / name, {1, 1, 8, {0, 0, 0}});
      FAIL() << "wrote " << name;
    } catch (const retrograde::UserError& error) {
      EXPECT_NE(std::string(error.what()).find("suffix says how it is stored"), std::string::npos);
    }
  }
  EXPECT_TRUE(fs::is_empty(folder_));
}

TEST_F(AppImages, AnyNumberOfChannelsGoesInAndOut) {
  for (int channels = 1; channels <= 5; ++channels) {
    apps::Image image{2, 1, 32, {}, channels};
    for (long n = 0; n < image.elems(); ++n) image.pixels.push_back(static_cast<float>(n) / 8);
    apps::write_image(folder_ / "a.tif", image);
    const apps::Image back = apps::read_channels(folder_ / "a.tif");
    EXPECT_EQ(back.channels, channels);
    EXPECT_EQ(back.pixels, image.pixels);
  }
}

TEST_F(AppImages, AGrayImageIsAMosaic) {
  const auto path = store("a.png", 2, 2, 1, OIIO::TypeDesc::UINT16, {0, 0.25f, 0.5f, 1});
  const apps::Mosaic mosaic = apps::read_mosaic(path);
  EXPECT_EQ(mosaic.image.channels, 1);
  EXPECT_EQ(mosaic.pattern, "");
  EXPECT_NEAR(mosaic.image.pixels[1], 0.25f, 1e-4);
  EXPECT_THROW(apps::read_mosaic(store("b.png", 1, 1, 3, OIIO::TypeDesc::UINT8, {0, 0, 0})),
               retrograde::UserError);
}

TEST_F(AppImages, AFolderGivesItsImagesInOrder) {
  EXPECT_THROW(apps::images_in(folder_), retrograde::UserError);
  EXPECT_THROW(apps::images_in(folder_ / "nowhere"), retrograde::UserError);
  apps::write_file(folder_ / "notes.txt", "no image");
  for (const char* name : {"b.png", "a.png"})
    apps::write_image(folder_ / name, {1, 1, 8, {0, 0, 0}});
  EXPECT_EQ(apps::images_in(folder_),
            (std::vector<fs::path>{folder_ / "a.png", folder_ / "b.png"}));
}

TEST_F(AppImages, ASampleThatIsNoNumberIsRefused) {
  const auto path = store("a.exr", 2, 1, 3, OIIO::TypeDesc::FLOAT,
                          {0, 0, 0, 0, std::numeric_limits<float>::quiet_NaN(), 0});
  try {
    apps::read_image(path);
    FAIL() << "read a NaN";
  } catch (const retrograde::UserError& error) {
    EXPECT_NE(std::string(error.what()).find("pixel (1, 0) holds"), std::string::npos)
        << error.what();
  }
}

TEST_F(AppImages, AWrittenFileReplacesTheOldOneWhole) {
  apps::write_file(folder_ / "f", "the old and longer text");
  apps::write_file(folder_ / "f", "new");
  EXPECT_EQ(fs::file_size(folder_ / "f"), 3u);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()), 1);
}

}  // namespace
