// noise.cpp -- see noise.h.
#include "noise.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace burst {

namespace {

constexpr double least_smoothness = 1e-3;
// Of normal noise, the median magnitude over the standard deviation.
constexpr double median_of_normal = 0.6744897501960817;
// The root of the sum of the squares of the nine weights below.
constexpr double gain = 6;
constexpr float dark_end = 1.0f / 255, light_end = 1 - dark_end;

// The magnitudes of one frame's second differences, two samples apart: the same colour.
void add_magnitudes(std::span<const float> frame, const FrameSize& size,
                    std::vector<float>& magnitudes) {
  constexpr float weights[3] = {1, -2, 1};
  for (int y = 2; y + 2 < size.height; ++y) {
    for (int x = 2; x + 2 < size.width; ++x) {
      float sum = 0;
      bool cut_off = false;
      for (int j = 0; j < 3; ++j) {
        for (int i = 0; i < 3; ++i) {
          const float sample =
              frame[static_cast<size_t>(y + 2 * j - 2) * static_cast<size_t>(size.width) +
                    static_cast<size_t>(x + 2 * i - 2)];
          cut_off |= sample < dark_end || sample > light_end;
          sum += weights[i] * weights[j] * sample;
        }
      }
      if (!cut_off) magnitudes.push_back(std::abs(sum));
    }
  }
}

}  // namespace

double estimate_noise(const Burst& burst) {
  std::vector<float> magnitudes;
  for (int n = 0; n < burst.frames(); ++n) add_magnitudes(burst.frame(n), burst.size, magnitudes);
  if (magnitudes.empty()) return 0;
  const auto middle = magnitudes.begin() + static_cast<long>(magnitudes.size() / 2);
  std::nth_element(magnitudes.begin(), middle, magnitudes.end());
  return *middle / (gain * median_of_normal);
}

double mean_difference(std::span<const float> planes, const FrameSize& size) {
  const auto width = static_cast<size_t>(size.width), height = static_cast<size_t>(size.height);
  double sum = 0;
  size_t count = 0;
  for (size_t c = 0; c < 3; ++c) {
    const auto plane = planes.subspan(c * size.pixels(), size.pixels());
    for (size_t y = 0; y + 1 < height; ++y) {
      for (size_t x = 0; x + 1 < width; ++x) {
        const float here = plane[y * width + x];
        sum +=
            std::abs(plane[y * width + x + 1] - here) + std::abs(plane[(y + 1) * width + x] - here);
        count += 2;
      }
    }
  }
  return sum / static_cast<double>(count);
}

double smoothness_for(double noise, double mean_difference) {
  constexpr double least_difference = 1e-4;  // of a picture that shows nothing
  return std::max(2 * noise * noise / std::max(mean_difference, least_difference),
                  least_smoothness);
}

}  // namespace burst
