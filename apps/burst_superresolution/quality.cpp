// quality.cpp -- see quality.h.
#include "quality.h"

#include <algorithm>
#include <cmath>

namespace burst {

double psnr_db(std::span<const float> planes, const Truth& truth, const FrameSize& size) {
  double sum = 0, count = 0;
  for (size_t c = 0; c < 3; ++c) {
    for (int y = truth.border; y < size.height - truth.border; ++y) {
      for (int x = truth.border; x < size.width - truth.border; ++x) {
        const size_t at = c * size.pixels() +
                          static_cast<size_t>(y) * static_cast<size_t>(size.width) +
                          static_cast<size_t>(x);
        const double error = std::clamp(planes[at], 0.0f, 1.0f) - truth.planes[at];
        sum += error * error;
        ++count;
      }
    }
  }
  return -10 * std::log10(std::max(sum / count, 1e-12));
}

}  // namespace burst
