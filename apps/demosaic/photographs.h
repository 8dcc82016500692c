// photographs.h -- pictures whose colours are known at every pixel, and the mosaics made of them.
//
// Samples are in sRGB's encoding and in [0, 1], as the literature on demosaicking has them: a mosaic is
// the picture with two of three samples of each pixel taken away. Pictures of floats hold linear light and
// are encoded first.
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

// The colour that the mosaic R G over G B has at a place: 0, 1 or 2.
inline int colour_at(int x, int y) { return (x & 1) + (y & 1); }

// The place in [0, n) that a mirror at the first and the last element shows at v: parity stays.
int mirrored(int v, int n);

// Throws retrograde::UserError for what apps::read_image refuses, and below 2 x 2 pixels.
Photograph read_photograph(const std::filesystem::path& path);
apps::Image image_of(int width, int height, int bits, std::span<const float> planes);

// [height, width], R G over G B.
std::vector<float> mosaic_of(const Photograph& photograph);

// Photographs to learn from, and others to be measured on.
struct Dataset {
  std::vector<Photograph> train = {}, held_out = {};
  std::string division;  // in words
};
// Divided as common/division.h says. Throws retrograde::UserError.
Dataset read_dataset(const std::filesystem::path& folder);

// 10 log10(1 / mean squared error), all pixels and colours alike; in linear light, or as encoded.
struct Quality {
  double encoded_db = 0, linear_db = 0;
};
Quality quality(const Photograph& truth, std::span<const float> planes);

}  // namespace demosaic
