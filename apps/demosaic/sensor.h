// sensor.h -- what a camera's sensor measured, of a RAW file or an image of one channel.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace demosaic {

// By its suffix.
bool is_raw(const std::filesystem::path& path);

// A mosaic that begins with red: others get a mirrored column, row or both put before them.
struct Sensor {
  int width = 0, height = 0, bits = 16;
  int left = 0, top = 0;       // what was put before
  std::vector<float> samples;  // [height, width], in sRGB's encoding
  int orientation = 1;         // how a picture made of it is to be turned: apps::upright
};

// `pattern`: the colours of its first two rows, as "RGGB"; empty: as the file says. RAW files and images of
// floats hold linear light, which is encoded. Throws retrograde::UserError for what apps::read_mosaic refuses,
// an unknown pattern, and below 2 x 2 samples.
Sensor read_sensor(const std::filesystem::path& path, const std::string& pattern);

}  // namespace demosaic
