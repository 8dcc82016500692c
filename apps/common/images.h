// images.h -- photographs as interleaved RGB floats, read and written through OpenImageIO.
#pragma once

#include <filesystem>
#include <vector>

namespace apps {

struct Image {
  int width = 0;
  int height = 0;
  int bits = 8;               // what the file stored per sample: 8, 16 or 32 (float)
  std::vector<float> pixels;  // [height, width, 3]; 1.0 is the brightest integer sample

  long elems() const { return 3L * width * height; }
};

// Images larger than this are refused: a step would need more memory than it is worth.
inline constexpr long max_pixels = 50'000'000;

// Any format, sample type and channel count that OpenImageIO decodes. Gray is spread over the three
// channels; alpha is left out. Throws retrograde::UserError when the file is missing, unreadable,
// truncated, empty or too large, or when a sample is not finite.
Image read_image(const std::filesystem::path& path);

// Stores a PNG with 8 bits a sample, or 16 when the image came with more than 8; samples are
// clamped to [0, 1]. Throws retrograde::UserError; see write_file.
void write_png(const std::filesystem::path& path, const Image& image);

}  // namespace apps
