// sensor.h -- reads a camera sensor's samples from a RAW file or an image of one channel.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace demosaic {

// Decided by the suffix.
bool is_raw(const std::filesystem::path& path);

// A mosaic that begins with red: others are extended by a mirrored column, row or both in front.
struct Sensor {
  int width = 0, height = 0, bits = 16;
  int left = 0, top = 0;       // columns and rows that were added
  std::vector<float> samples;  // [height, width], in sRGB's encoding
  int orientation = 1;         // how to turn a picture made from it: apps::upright
};

// `pattern`: the colours of its first two rows, as "RGGB"; empty: as the file says. RAW files and float images hold
// linear light, which is encoded. Throws retrograde::UserError for files that apps::read_mosaic rejects, for an unknown
// pattern, and for fewer than 2 x 2 samples.
Sensor read_sensor(const std::filesystem::path& path, const std::string& pattern);

}  // namespace demosaic
