// average.cpp -- see average.h.
#include "average.h"

#include "bicubic.h"

namespace burst {

namespace {

// In pixels; the inverse of the identity may miss a border by a few bits.
constexpr double rounding = 1e-6;

}  // namespace

BicubicAverage::BicubicAverage(const FrameSize& size)
    : size_(size), sums_(3 * size.pixels(), 0.0f), counts_(size.pixels(), 0) {}

void BicubicAverage::add(std::span<const float> frame, const Homography& homography) {
  const Homography to_frame = inverse(homography, size_);
  for (int y = 0; y < size_.height; ++y) add_row(frame, to_frame, y);
}

void BicubicAverage::add_row(std::span<const float> frame, const Homography& to_frame, int y) {
  for (int x = 0; x < size_.width; ++x) {
    const Place at = place_of(to_frame, size_, x, y);
    const bool inside = at.x >= -rounding && at.x <= size_.width - 1 + rounding &&
                        at.y >= -rounding && at.y <= size_.height - 1 + rounding;
    if (!inside) continue;
    const size_t pixel =
        static_cast<size_t>(y) * static_cast<size_t>(size_.width) + static_cast<size_t>(x);
    ++counts_[pixel];
    for (size_t c = 0; c < 3; ++c) {
      sums_[c * size_.pixels() + pixel] +=
          static_cast<float>(bicubic(frame.subspan(c * size_.pixels(), size_.pixels()), size_.width,
                                     size_.height, at.x, at.y));
    }
  }
}

std::vector<float> BicubicAverage::take() const {
  std::vector<float> average = sums_;
  for (size_t n = 0; n < average.size(); ++n)
    average[n] /= static_cast<float>(counts_[n % size_.pixels()]);
  return average;
}

}  // namespace burst
