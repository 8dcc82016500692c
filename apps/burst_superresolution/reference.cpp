// reference.cpp -- see reference.h.
#include "reference.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "demosaic/photographs.h"

namespace burst::reference {

namespace {

// The pixel left of (or above) a position, and the distance to it.
struct Split {
  int left;
  double fraction;
};

Split split(double at, int side) {
  const int left = std::clamp(static_cast<int>(std::floor(at)), 0, side - 2);
  return {left, at - left};
}

class Sum {
 public:
  Sum(const Shape& shape, std::span<const double> x, std::span<const float> samples)
      : shape_(shape), size_(shape.size), x_(x), samples_(samples) {
    value_.gradient.assign(x.size(), 0.0);
  }

  void add_frame(int n) {
    Homography h{};
    std::copy_n(x_.begin() + static_cast<long>(motion(n)), h.size(), h.begin());
    for (int y = 0; y < size_.height; ++y) {
      for (int x = 0; x < size_.width; ++x) add_sample(n, h, x, y);
    }
  }

  void add_differences(const ColourAxis& axis) {
    for (int y = 0; y < size_.height; ++y) {
      for (int x = 0; x < size_.width; ++x) {
        if (x + 1 < size_.width) add_difference(axis, at(x, y, 0), at(x + 1, y, 0));
        if (y + 1 < size_.height) add_difference(axis, at(x, y, 0), at(x, y + 1, 0));
      }
    }
  }

  Value take() { return std::move(value_); }

 private:
  size_t at(int x, int y, int c) const {
    return static_cast<size_t>(c) * size_.pixels() +
           static_cast<size_t>(y) * static_cast<size_t>(size_.width) + static_cast<size_t>(x);
  }
  size_t motion(int n) const {
    return shape_.image_elems() + homography_params * static_cast<size_t>(n);
  }

  void add_sample(int n, const Homography& h, int x, int y) {
    value_.sampled.push_back(0);
    if (!(depth_at(h, size_, x, y) > least_depth)) return;
    const Place place = place_of(h, size_, x, y);
    if (!(place.x >= 0 && place.x <= size_.width - 1 && place.y >= 0 &&
          place.y <= size_.height - 1))
      return;
    const Split across = split(place.x, size_.width), down = split(place.y, size_.height);
    const int c = demosaic::colour_at(x, y);
    const double fx = across.fraction, fy = down.fraction;
    const std::array<size_t, 4> taps{
        at(across.left, down.left, c), at(across.left + 1, down.left, c),
        at(across.left, down.left + 1, c), at(across.left + 1, down.left + 1, c)};
    const std::array<double, 4> weights{(1 - fx) * (1 - fy), fx * (1 - fy), (1 - fx) * fy, fx * fy};
    double sampled = 0;
    for (size_t k = 0; k < 4; ++k) sampled += weights[k] * x_[taps[k]];
    value_.sampled.back() = sampled;
    const double residual = sampled - samples_[value_.sampled.size() - 1];
    value_.loss += residual * residual;
    for (size_t k = 0; k < 4; ++k) value_.gradient[taps[k]] += 2 * residual * weights[k];
    const auto r = [&](size_t k) { return x_[taps[k]]; };
    const double by_x = (1 - fy) * (r(1) - r(0)) + fy * (r(3) - r(2));
    const double by_y = (1 - fx) * (r(2) - r(0)) + fx * (r(3) - r(1));
    add_motion(motion(n), h, x, y, 2 * residual * by_x, 2 * residual * by_y);
  }

  // In the units of homography.h: position = centre + s (a / w, b / w) with a = (1 + h0) u + h1 v + h2, b = h3 u + (1 +
  // h4) v + h5.
  void add_motion(size_t to, const Homography& h, int x, int y, double by_x, double by_y) {
    const double s = size_.scale();
    const double u = (x - size_.centre_x()) / s, v = (y - size_.centre_y()) / s;
    const double w = 1 + h[6] * u + h[7] * v;
    const double a = (1 + h[0]) * u + h[1] * v + h[2], b = h[3] * u + (1 + h[4]) * v + h[5];
    const double by_a = by_x * s / w, by_b = by_y * s / w;
    const double by_w = -(by_a * a + by_b * b) / w;
    const std::array<double, 8> terms{by_a * u, by_a * v, by_a,     by_b * u,
                                      by_b * v, by_b,     by_w * u, by_w * v};
    for (size_t k = 0; k < terms.size(); ++k) value_.gradient[to + k] += terms[k];
  }

  // The difference between two pixels, given by the indices of their red samples.
  void add_difference(const ColourAxis& axis, size_t from, size_t to) {
    double step = 0;
    for (size_t c = 0; c < 3; ++c)
      step += axis.along[c] * (x_[to + c * size_.pixels()] - x_[from + c * size_.pixels()]);
    value_.loss += axis.weight * std::abs(step);
    const double sign = step > 0 ? 1 : step < 0 ? -1 : 0;
    for (size_t c = 0; c < 3; ++c) {
      value_.gradient[to + c * size_.pixels()] += axis.weight * sign * axis.along[c];
      value_.gradient[from + c * size_.pixels()] -= axis.weight * sign * axis.along[c];
    }
  }

  const Shape& shape_;
  const FrameSize& size_;
  std::span<const double> x_;
  std::span<const float> samples_;
  Value value_;
};

}  // namespace

Value objective(const Shape& shape, const Smoothness& smoothness, std::span<const double> x,
                std::span<const float> samples) {
  Sum sum(shape, x, samples);
  for (int n = 0; n < shape.frames; ++n) sum.add_frame(n);
  for (const ColourAxis& axis : smoothness) sum.add_differences(axis);
  return sum.take();
}

}  // namespace burst::reference
