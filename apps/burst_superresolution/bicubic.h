// bicubic.h -- interpolates between the pixels of a plane, by R. Keys, Cubic convolution interpolation for digital
// image processing, IEEE Transactions on Acoustics, Speech, and Signal Processing 29 (6), 1981, eq. 15.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>

namespace burst {

// The weights of the four samples at -1, 0, 1, 2 for a position 0 <= f < 1.
inline std::array<double, 4> cubic_weights(double f) {
  return {((-0.5 * f + 1) * f - 0.5) * f, (1.5 * f - 2.5) * f * f + 1,
          ((-1.5 * f + 2) * f + 0.5) * f, (0.5 * f - 0.5) * f * f};
}

// plane: [height, width]; its edges are repeated beyond the borders.
inline double bicubic(std::span<const float> plane, int width, int height, double x, double y) {
  const double x0 = std::floor(x), y0 = std::floor(y);
  const auto wx = cubic_weights(x - x0), wy = cubic_weights(y - y0);
  double sum = 0;
  for (int j = 0; j < 4; ++j) {
    const int row = std::clamp(static_cast<int>(y0) + j - 1, 0, height - 1);
    const float* from = plane.data() + static_cast<size_t>(row) * static_cast<size_t>(width);
    double along = 0;
    for (int i = 0; i < 4; ++i) {
      along +=
          wx[static_cast<size_t>(i)] * from[std::clamp(static_cast<int>(x0) + i - 1, 0, width - 1)];
    }
    sum += wy[static_cast<size_t>(j)] * along;
  }
  return sum;
}

}  // namespace burst
