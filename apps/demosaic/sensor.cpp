#include "sensor.h"

#include <algorithm>
#include <cctype>

#include "common/images.h"
#include "diagnostics/error.h"
#include "photographs.h"

namespace demosaic {

using retrograde::quoted;
using retrograde::text;

namespace {

Sensor begin_with_red(const apps::Image& mosaic, const std::string& pattern, bool is_light) {
  const int left = pattern[0] == 'G' ? (pattern[1] == 'R' ? 1 : 0) : (pattern[0] == 'B' ? 1 : 0);
  const int top = pattern[0] == 'G' ? (pattern[1] == 'R' ? 0 : 1) : (pattern[0] == 'B' ? 1 : 0);
  Sensor sensor{mosaic.width + left, mosaic.height + top, mosaic.bits, left, top, {}, 1};
  for (int y = 0; y < sensor.height; ++y) {
    for (int x = 0; x < sensor.width; ++x) {
      const auto from = static_cast<size_t>(mirrored(y - top, mosaic.height)) *
                            static_cast<size_t>(mosaic.width) +
                        static_cast<size_t>(mirrored(x - left, mosaic.width));
      const float value = mosaic.pixels[from];
      sensor.samples.push_back(is_light ? encoded(value) : std::clamp(value, 0.0f, 1.0f));
    }
  }
  return sensor;
}

}  // namespace

bool is_raw(const std::filesystem::path& path) {
  static const std::vector<std::string> suffixes{".dng", ".cr2", ".cr3", ".nef", ".arw",
                                                 ".orf", ".raf", ".rw2", ".pef", ".srw"};
  std::string suffix = path.extension().string();
  for (char& c : suffix) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return std::find(suffixes.begin(), suffixes.end(), suffix) != suffixes.end();
}

Sensor read_sensor(const std::filesystem::path& path, const std::string& pattern) {
  const apps::Mosaic mosaic = apps::read_mosaic(path);
  const std::string named = pattern.empty() ? mosaic.pattern : pattern;
  const std::string colours = "RGGB GRBG GBRG BGGR";
  if (named.size() != 4 || colours.find(named) == std::string::npos) {
    retrograde::call_error(text("read the mosaic ", quoted(path.string())),
                           "a mosaic begins with RGGB, GRBG, GBRG or BGGR",
                           named.empty() ? std::string("the file does not say with which")
                                         : text("the file says ", quoted(named)),
                           "Give --mosaic with the colours of its first two rows");
  }
  if (mosaic.image.width < 2 || mosaic.image.height < 2) {
    retrograde::call_error(text("read the mosaic ", quoted(path.string())),
                           "a mosaic needs a whole cell, 2 x 2 samples",
                           text("it has ", mosaic.image.width, " x ", mosaic.image.height),
                           "Give a larger one");
  }
  // A sensor's measurements are linear in light.
  Sensor sensor = begin_with_red(mosaic.image, named, is_raw(path) || mosaic.image.bits == 32);
  sensor.orientation = mosaic.orientation;
  return sensor;
}

}  // namespace demosaic
