// photographs.h -- pictures whose colours are known at every pixel, and mosaics made from them.
//
// Samples are sRGB-encoded and in [0, 1], as in the literature on demosaicking: a mosaic is the picture with two of the
// three samples of each pixel removed. Float pictures hold linear light and are encoded first.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "common/images.h"

namespace demosaic {

struct Photograph {
  std::string name;
  int width = 0, height = 0, bits = 8;
  std::vector<float> planes;  // [3, height, width]

  size_t pixels() const { return static_cast<size_t>(width) * static_cast<size_t>(height); }
  float at(int x, int y, int c) const {
    return planes[static_cast<size_t>(c) * pixels() +
                  static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x)];
  }
};

// sRGB's curves (IEC 61966-2-1).
float encoded(float light);
float decoded(float value);

// The colour of the mosaic R G over G B at a position: 0, 1 or 2.
inline int colour_at(int x, int y) { return (x & 1) + (y & 1); }

// Mirrors v at the first and last element into [0, n), which preserves parity.
int mirrored(int v, int n);

// Throws retrograde::UserError for files that apps::read_image rejects, and for fewer than 2 x 2 pixels.
Photograph read_photograph(const std::filesystem::path& path);
apps::Image image_of(int width, int height, int bits, std::span<const float> planes);

// [height, width], R G over G B.
std::vector<float> mosaic_of(const Photograph& photograph);

// Photographs for learning, and others for measuring.
struct Dataset {
  std::vector<Photograph> train = {}, held_out = {};
  std::string division;  // in words
};
// Divided by common/division.h. Throws retrograde::UserError.
Dataset read_dataset(const std::filesystem::path& folder);

// 10 log10(1 / mean squared error) over all pixels and colours; in linear light, or encoded.
struct Quality {
  double encoded_db = 0, linear_db = 0;
};
Quality quality(const Photograph& truth, std::span<const float> planes);

}  // namespace demosaic
