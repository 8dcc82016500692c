// scenes.h -- test pictures for bursts, with structure everywhere at several scales.
#pragma once

#include <algorithm>
#include <cmath>

#include "demosaic/photographs.h"

namespace burst_test {

// Overlapping discs of many sizes and colours with soft edges, which give feature detectors corners and blobs.
inline demosaic::Photograph scene(int width, int height, unsigned seed = 1) {
  unsigned state = seed * 2654435761u + 12345;
  const auto unit = [&] {
    state = state * 1664525 + 1013904223;
    return static_cast<double>(state >> 8) / (1 << 24);
  };
  demosaic::Photograph picture{"scene", width, height, 8, {}};
  const size_t pixels = picture.pixels();
  picture.planes.assign(3 * pixels, 0.4f);
  const int discs = width * height / 60;
  for (int n = 0; n < discs; ++n) {
    const double radius = 1.5 + 9 * unit() * unit(), x0 = width * unit(), y0 = height * unit();
    const double colours[3] = {unit(), unit(), unit()};
    const int reach = static_cast<int>(radius) + 2;
    for (int y = std::max(0, static_cast<int>(y0) - reach);
         y < std::min(height, static_cast<int>(y0) + reach + 1); ++y) {
      for (int x = std::max(0, static_cast<int>(x0) - reach);
           x < std::min(width, static_cast<int>(x0) + reach + 1); ++x) {
        const double inside = radius - std::hypot(x - x0, y - y0);
        const double share = inside > 1 ? 1 : inside < -1 ? 0 : (inside + 1) / 2;
        for (size_t c = 0; c < 3; ++c) {
          float& value =
              picture.planes[c * pixels + static_cast<size_t>(y) * static_cast<size_t>(width) +
                             static_cast<size_t>(x)];
          value += static_cast<float>(share * (0.1 + 0.8 * colours[c] - value));
        }
      }
    }
  }
  return picture;
}

}  // namespace burst_test
