// scenes.h -- test pictures for deconvolution, with edges and texture.
#pragma once

#include <cmath>
#include <string>

#include "demosaic/photographs.h"

namespace deconvolution_test {

// Squares of different brightness and tint over slow waves, in [0, 1].
inline demosaic::Photograph scene(int width, int height, int variant = 0) {
  demosaic::Photograph result{"scene", width, height, 8, {}};
  for (int c = 0; c < 3; ++c) {
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const int cell = (x + 3 * variant) / 11 * 7 + y / 9 * 13 + 5 * variant;
        const double square = static_cast<double>(cell * 37 % 17) / 17;
        const double wave = std::sin(0.11 * x + 0.07 * y + c + variant);
        result.planes.push_back(static_cast<float>(0.15 + 0.6 * square + 0.1 * wave));
      }
    }
  }
  return result;
}

}  // namespace deconvolution_test
