// noise.cpp -- see noise.h.
#include "noise.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "demosaic/photographs.h"

namespace burst {

namespace {

constexpr double least_weight = 1e-3;
constexpr double least_difference = 1e-4;  // for pictures without any content
constexpr int square_side = 16;
// For normal noise: the median magnitude divided by the standard deviation.
constexpr double median_of_normal = 0.6744897501960817;
// The root of the sum of the squares of the nine weights below.
constexpr double gain = 6;
constexpr float dark_end = 1.0f / 255, light_end = 1 - dark_end;

// The magnitude of the second difference around a position, of samples two apart; negative if one of them is clipped.
float magnitude_at(std::span<const float> frame, const FrameSize& size, int x, int y) {
  constexpr float weights[3] = {1, -2, 1};
  float sum = 0;
  for (int j = 0; j < 3; ++j) {
    for (int i = 0; i < 3; ++i) {
      const float sample =
          frame[static_cast<size_t>(y + 2 * j - 2) * static_cast<size_t>(size.width) +
                static_cast<size_t>(x + 2 * i - 2)];
      if (sample < dark_end || sample > light_end) return -1;
      sum += weights[i] * weights[j] * sample;
    }
  }
  return std::abs(sum);
}

float quantile(std::vector<float>& values, double share) {
  const auto place = values.begin() + static_cast<long>(share * static_cast<double>(values.size()));
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

// The median magnitude of a square over all frames; nothing if most of it is clipped.
std::optional<float> median_of_square(const Burst& burst, int left, int top) {
  std::vector<float> magnitudes;
  for (int n = 0; n < burst.frames(); ++n) {
    for (int y = top; y < std::min(top + square_side, burst.size.height - 2); ++y) {
      for (int x = left; x < std::min(left + square_side, burst.size.width - 2); ++x) {
        const float magnitude = magnitude_at(burst.frame(n), burst.size, x, y);
        if (magnitude >= 0) magnitudes.push_back(magnitude);
      }
    }
  }
  const auto enough = static_cast<size_t>(burst.frames() * square_side * square_side / 2);
  if (magnitudes.size() < enough) return {};
  return quantile(magnitudes, 0.5);
}

// Bilinear interpolation of the picture at a position, in one colour.
double bilinear(std::span<const float> plane, const FrameSize& size, const Place& at) {
  const int left = std::clamp(static_cast<int>(at.x), 0, size.width - 2);
  const int top = std::clamp(static_cast<int>(at.y), 0, size.height - 2);
  const double fx = at.x - left, fy = at.y - top;
  const float* p = plane.data() + static_cast<size_t>(top) * static_cast<size_t>(size.width) +
                   static_cast<size_t>(left);
  const double above = p[0] + fx * (p[1] - p[0]);
  p += size.width;
  return above + fy * (p[0] + fx * (p[1] - p[0]) - above);
}

void add_residuals(std::span<const float> frame, const FrameSize& size,
                   std::span<const float> picture, const Homography& h,
                   std::vector<float>& magnitudes) {
  size_t n = 0;
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x, ++n) {
      const Place at = place_of(h, size, x, y);
      const bool inside =
          at.x >= 0 && at.x <= size.width - 1 && at.y >= 0 && at.y <= size.height - 1;
      if (!inside || frame[n] < dark_end || frame[n] > light_end) continue;
      const auto c = static_cast<size_t>(demosaic::colour_at(x, y));
      const double seen = bilinear(picture.subspan(c * size.pixels(), size.pixels()), size, at);
      magnitudes.push_back(static_cast<float>(std::abs(seen - frame[n])));
    }
  }
}

}  // namespace

double estimate_noise(const Burst& burst, std::span<const float> x) {
  const Shape shape{burst.size, burst.frames()};
  std::vector<float> magnitudes;
  for (int n = 0; n < burst.frames(); ++n) {
    Homography h{};
    std::copy_n(x.begin() + static_cast<long>(shape.image_elems()) + homography_params * n,
                h.size(), h.begin());
    add_residuals(burst.frame(n), burst.size, x.first(shape.image_elems()), h, magnitudes);
  }
  if (magnitudes.empty()) return 0;
  const double followed = 3.0 / burst.frames();
  return quantile(magnitudes, 0.5) / median_of_normal / std::sqrt(1 - followed);
}

double estimate_noise(const Burst& burst) {
  std::vector<float> medians;
  for (int top = 2; top + 2 < burst.size.height; top += square_side) {
    for (int left = 2; left + 2 < burst.size.width; left += square_side) {
      if (const auto median = median_of_square(burst, left, top)) medians.push_back(*median);
    }
  }
  if (medians.empty()) return 0;
  return quantile(medians, 0.1) / (gain * median_of_normal);
}

std::array<std::array<double, 3>, 3> axes_of(Colours colours) {
  if (colours == Colours::Rgb) return {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  const double a = 1 / std::sqrt(3.0), b = 1 / std::sqrt(2.0), c = 1 / std::sqrt(6.0);
  return {{{a, a, a}, {b, 0, -b}, {c, -2 * c, c}}};
}

double mean_difference(std::span<const float> planes, const FrameSize& size,
                       const std::array<double, 3>& axis) {
  const auto width = static_cast<size_t>(size.width), height = static_cast<size_t>(size.height);
  const auto along = [&](size_t at) {
    return axis[0] * planes[at] + axis[1] * planes[size.pixels() + at] +
           axis[2] * planes[2 * size.pixels() + at];
  };
  double sum = 0;
  for (size_t y = 0; y + 1 < height; ++y) {
    for (size_t x = 0; x + 1 < width; ++x) {
      const double here = along(y * width + x);
      sum +=
          std::abs(along(y * width + x + 1) - here) + std::abs(along((y + 1) * width + x) - here);
    }
  }
  return sum / static_cast<double>(2 * (width - 1) * (height - 1));
}

Smoothness smoothness_for(double noise, std::span<const float> planes, const FrameSize& size,
                          Colours colours, std::optional<double> given) {
  if (given && *given == 0) return {};
  Smoothness smoothness;
  for (const auto& axis : axes_of(colours)) {
    const double mean = std::max(mean_difference(planes, size, axis), least_difference);
    smoothness.push_back({axis, std::max(2 * noise * noise / mean, least_weight)});
  }
  if (!given) return smoothness;
  const double factor = *given / smoothness[0].weight;
  for (ColourAxis& axis : smoothness) axis.weight *= factor;
  if (colours == Colours::Rgb) {
    for (ColourAxis& axis : smoothness) axis.weight = *given;
  }
  return smoothness;
}

}  // namespace burst
