// Tests reading images of every kind as RGB floats, and writing PNG.
#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>

#include "common/files.h"
#include "common/images.h"
#include "diagnostics/error.h"
#include "support/temporary_folder.h"

namespace {

namespace fs = std::filesystem;

// A minimal RAW file: Adobe's DNG (Digital Negative Specification 1.4, chapter 4), which is TIFF with the tags of a
// colour filter array. The samples are those of a sensor with the pattern "RGGB".
class SmallDng {
 public:
  SmallDng(int width, int height, const std::vector<uint16_t>& samples, uint32_t orientation = 1) {
    number(254, 4, {0});  // the full image
    number(256, 4, {static_cast<uint32_t>(width)});
    number(257, 4, {static_cast<uint32_t>(height)});
    number(258, 3, {16});
    number(259, 3, {1});
    number(262, 3, {32803});  // a colour filter array
    words(271, "Retrograde");
    words(272, "Test");
    const size_t place = number(273, 4, {0});
    number(274, 3, {orientation});
    number(277, 3, {1});
    number(278, 4, {static_cast<uint32_t>(height)});
    number(279, 4, {static_cast<uint32_t>(2 * samples.size())});
    number(284, 3, {1});
    number(33421, 3, {2, 2});
    number(33422, 1, {0, 1, 1, 2});
    number(50706, 1, {1, 4, 0, 0});
    words(50708, "Retrograde Test");
    number(50710, 1, {0, 1, 2});  // red, green, blue
    number(50711, 3, {1});
    number(50714, 3, {0});
    number(50717, 4, {65535});
    number(50721, 10, {1, 1, 0, 1, 0, 1, 0, 1, 1, 1, 0, 1, 0, 1, 0, 1, 1, 1});
    number(50728, 5, {1, 1, 1, 1, 1, 1});
    number(50778, 3, {21});
    finish(place, samples);
  }
  const std::string& bytes() const { return bytes_; }

 private:
  struct Entry {
    uint16_t tag, type;
    uint32_t count;
    std::string data;
  };
  size_t number(uint16_t tag, uint16_t type, const std::vector<uint32_t>& values) {
    const size_t each = type == 1 ? 1 : type == 3 ? 2 : 4;
    const size_t parts = type == 5 || type == 10 ? 2 : 1;  // rationals
    Entry entry{tag, type, static_cast<uint32_t>(values.size() / parts), {}};
    for (const uint32_t value : values)
      entry.data.append(reinterpret_cast<const char*>(&value), each);  // little-endian
    entries_.push_back(entry);
    return entries_.size() - 1;
  }
  void words(uint16_t tag, const std::string& text) {
    entries_.push_back({tag, 2, static_cast<uint32_t>(text.size() + 1), text + '\0'});
  }
  template <typename T>
  void append(T value) {
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  // Writes the header, the directory, the values that are too large for its entries, and the samples.
  void finish(size_t place, const std::vector<uint16_t>& samples) {
    const uint32_t behind = 8 + 2 + 12 * static_cast<uint32_t>(entries_.size()) + 4;
    std::string rest;
    for (Entry& entry : entries_) entry.data.resize(std::max<size_t>(entry.data.size(), 4));
    uint32_t after = behind;
    for (const Entry& entry : entries_)
      after += entry.data.size() > 4 ? static_cast<uint32_t>(entry.data.size() + 1) / 2 * 2 : 0;
    entries_[place].data.assign(reinterpret_cast<const char*>(&after), 4);
    bytes_ = "II*";
    bytes_ += '\0';
    append<uint32_t>(8);
    append(static_cast<uint16_t>(entries_.size()));
    for (const Entry& entry : entries_) {
      append(entry.tag);
      append(entry.type);
      append(entry.count);
      if (entry.data.size() == 4) {
        bytes_ += entry.data;
        continue;
      }
      append(static_cast<uint32_t>(behind + rest.size()));
      rest += entry.data;
      if (rest.size() % 2) rest += '\0';
    }
    append<uint32_t>(0);
    bytes_ += rest;
    for (const uint16_t sample : samples) append(sample);
  }

  std::vector<Entry> entries_;
  std::string bytes_;
};

void expect_pixels(const apps::Image& image, const std::vector<float>& expected) {
  ASSERT_EQ(image.pixels.size(), expected.size());
  for (size_t n = 0; n < expected.size(); ++n) EXPECT_FLOAT_EQ(image.pixels[n], expected[n]);
}

class AppImages : public testing::Test {
 protected:
  // Stores a file in which sample n is values[n].
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

  // Samples that are multiples of `step`, wrapped around at white.
  static apps::Image ramp(int width, int height, int bits, int step) {
    apps::Image image{width, height, bits, {}};
    const long values = 1L << bits;
    for (long n = 0; n < image.elems(); ++n)
      image.pixels.push_back(static_cast<float>(n * step % values) /
                             static_cast<float>(values - 1));
    return image;
  }

  apps::Image stored_and_read(const apps::Image& image) const {
    apps::write_png(folder_ / "a.png", image);
    return apps::read_image(folder_ / "a.png");
  }

  const TemporaryFolder temporary_;
  const fs::path& folder_ = temporary_.path();
};

TEST_F(AppImages, EightBitsSurviveARoundTrip) {
  const apps::Image image = ramp(5, 3, 8, 11), back = stored_and_read(image);
  EXPECT_EQ(back.width, 5);
  EXPECT_EQ(back.height, 3);
  EXPECT_EQ(back.bits, 8);
  for (long n = 0; n < image.elems(); ++n) EXPECT_FLOAT_EQ(back.pixels[n], image.pixels[n]);
}

TEST_F(AppImages, SixteenBitsSurviveARoundTrip) {
  const apps::Image image = ramp(4, 2, 16, 2711), back = stored_and_read(image);
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
  // No other file is left in the folder.
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()), 5);
}

TEST_F(AppImages, AnUnknownSuffixIsRefusedBeforeAnythingIsWritten) {
  for (const char* name : {"a.xyz", "a"}) {
    try {
      apps::write_image(folder_ / name, {1, 1, 8, {0, 0, 0}});
      FAIL() << "wrote " << name;
    } catch (const retrograde::UserError& error) {
      EXPECT_NE(std::string(error.what()).find("suffix selects its format"), std::string::npos);
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

TEST_F(AppImages, ARawFileGivesWhatTheSensorSawOrAPhotograph) {
  const int width = 64, height = 48;
  std::vector<uint16_t> samples;
  for (int n = 0; n < width * height; ++n)
    samples.push_back(static_cast<uint16_t>(10000 + n % width * 500 + n / width * 100));
  apps::write_file(folder_ / "a.dng", SmallDng(width, height, samples).bytes());
  const apps::Mosaic mosaic = apps::read_mosaic(folder_ / "a.dng");
  EXPECT_EQ(mosaic.pattern, "RGGB");
  ASSERT_EQ(mosaic.image.pixels.size(), samples.size());
  for (size_t n = 0; n < samples.size(); ++n)
    EXPECT_NEAR(mosaic.image.pixels[n], static_cast<float>(samples[n]) / 65535.0f, 1e-6) << n;
  const apps::Image photo = apps::read_image(folder_ / "a.dng");
  EXPECT_EQ(photo.width, width);
  EXPECT_EQ(photo.channels, 3);
}

TEST_F(AppImages, ResizingKeepsMeansAndRamps) {
  apps::Image ramp{12, 6, 32, {}, 2};
  for (int y = 0; y < 6; ++y)
    for (int x = 0; x < 12; ++x) ramp.pixels.insert(ramp.pixels.end(), {x / 12.0f, y / 6.0f});
  EXPECT_EQ(apps::resized(ramp, 12, 6).pixels, ramp.pixels);
  const apps::Image half = apps::resized(ramp, 6, 3);
  ASSERT_EQ(half.width, 6);
  ASSERT_EQ(half.height, 3);
  for (int x = 1; x < 5; ++x) EXPECT_NEAR(half.pixels[2 * (6 + x)], (2 * x + 0.5f) / 12, 1e-6);
  EXPECT_NEAR(half.pixels[2 * (6 + 2) + 1], 2.5f / 6, 1e-6);
  const apps::Image twice = apps::resized(ramp, 24, 12);
  for (int x = 2; x < 22; ++x) EXPECT_NEAR(twice.pixels[2 * (24 * 5 + x)], (x - 0.5f) / 24, 1e-6);
}

// A JPEG whose rows are ramps along x, with colours that no mirrored image has.
class AppPhotographs : public AppImages {
 protected:
  fs::path store_ramp(const std::string& name, int width, int height, int orientation) {
    std::vector<float> pixels;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) pixels.insert(pixels.end(), {x / 64.0f, y / 64.0f, 0.25f});
    }
    const fs::path path = folder_ / name;
    auto output = OIIO::ImageOutput::create(path.string());
    OIIO::ImageSpec spec(width, height, 3, OIIO::TypeDesc::UINT8);
    spec["Orientation"] = orientation;
    spec["CompressionQuality"] = 100;
    EXPECT_TRUE(output && output->open(path.string(), spec) &&
                output->write_image(OIIO::TypeDesc::FLOAT, pixels.data()) && output->close());
    return path;
  }
  std::string contents(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
};

// The position at which the stored pixel (x, y) of w x h is shown, by the definition of the tag: it names the side of
// the picture of the first row, and that of the first column.
std::pair<int, int> place_shown(int orientation, int x, int y, int w, int h) {
  switch (orientation) {
    case 2:  // top, right
      return {w - 1 - x, y};
    case 3:  // bottom, right
      return {w - 1 - x, h - 1 - y};
    case 4:  // bottom, left
      return {x, h - 1 - y};
    case 5:  // left, top
      return {y, x};
    case 6:  // right, top
      return {h - 1 - y, x};
    case 7:  // right, bottom
      return {h - 1 - y, w - 1 - x};
    case 8:  // left, bottom
      return {y, w - 1 - x};
    default:
      return {x, y};
  }
}

TEST_F(AppPhotographs, ComeUprightAndGoOutUpright) {
  const int w = 40, h = 24;
  for (const std::string suffix : {".jpg", ".tif"}) {
    for (int orientation = 1; orientation <= 8; ++orientation) {
      const auto path = store_ramp("a" + suffix, w, h, orientation);
      const apps::Image image = apps::read_image(path);
      ASSERT_EQ(image.width, orientation < 5 ? w : h) << orientation;
      ASSERT_EQ(image.height, orientation < 5 ? h : w) << orientation;
      EXPECT_EQ(apps::read_channels(path).pixels, image.pixels);
      for (const auto& [x, y] : {std::pair{0, 0}, {w - 1, 0}, {0, h - 1}, {17, 5}}) {
        const auto [u, v] = place_shown(orientation, x, y, w, h);
        const size_t at = static_cast<size_t>(v * image.width + u) * 3;
        EXPECT_NEAR(image.pixels[at], x / 64.0f, 0.04) << orientation;
        EXPECT_NEAR(image.pixels[at + 1], y / 64.0f, 0.04) << orientation;
      }
      // The written file looks the same in viewers that apply the orientation and in those that ignore it.
      apps::write_image(folder_ / ("b" + suffix), image);
      EXPECT_EQ(OIIO::ImageInput::open((folder_ / ("b" + suffix)).string())
                    ->spec()
                    .get_int_attribute("Orientation", 1),
                1);
      EXPECT_EQ(apps::read_image(folder_ / ("b" + suffix)).width, image.width);
    }
  }
}

// A sensor's samples are not rotated, because their pattern depends on the position; code that makes a picture of them
// rotates it.
TEST_F(AppPhotographs, AMosaicIsNotTurnedButSaysHow) {
  std::vector<uint16_t> samples;
  for (int n = 0; n < 64 * 48; ++n) samples.push_back(static_cast<uint16_t>(10000 + 10 * n));
  for (const int orientation : {1, 3, 6, 8}) {
    apps::write_file(folder_ / "a.dng",
                     SmallDng(64, 48, samples, static_cast<uint32_t>(orientation)).bytes());
    const apps::Mosaic mosaic = apps::read_mosaic(folder_ / "a.dng");
    EXPECT_EQ(mosaic.image.width, 64);
    EXPECT_EQ(mosaic.orientation, orientation);
    ASSERT_EQ(mosaic.image.pixels.size(), samples.size());
    for (size_t n = 0; n < samples.size(); ++n)
      ASSERT_NEAR(mosaic.image.pixels[n], static_cast<float>(samples[n]) / 65535.0f, 1e-6) << n;
    const apps::Image photograph = apps::read_image(folder_ / "a.dng");
    EXPECT_EQ(photograph.width, orientation < 5 ? 64 : 48);
    EXPECT_EQ(photograph.height, orientation < 5 ? 48 : 64);
  }
  // A gray image that is read as a mosaic has an orientation, too.
  apps::write_image(folder_ / "a.tif", {1, 1, 8, {0.5f}, 1});
  EXPECT_EQ(apps::read_mosaic(folder_ / "a.tif").orientation, 1);
}

TEST_F(AppPhotographs, ThatAreNotWholeAreRefused) {
  const std::string whole = contents(store_ramp("a.jpg", 64, 64, 1));
  const auto error_of = [&](const std::string& bytes) -> std::string {
    apps::write_file(folder_ / "b.jpg", bytes);
    try {
      apps::read_image(folder_ / "b.jpg");
    } catch (const retrograde::UserError& error) {
      return error.what();
    }
    return "no error";
  };
  EXPECT_EQ(error_of(whole), "no error");
  EXPECT_EQ(error_of(whole + "and a tail"), "no error");
  for (const size_t kept : {whole.size() / 2, whole.size() - 100, whole.size() - 2})
    EXPECT_NE(error_of(whole.substr(0, kept)).find("must be a whole image"), std::string::npos)
        << error_of(whole.substr(0, kept));
  // A file with a piece missing in the middle.
  EXPECT_NE(error_of(whole.substr(0, whole.size() - 300) + whole.substr(whole.size() - 2))
                .find("must be a whole image"),
            std::string::npos);
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
