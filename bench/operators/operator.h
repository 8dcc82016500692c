// operator.h -- helpers that several operators share.
#pragma once

#include <cmath>

#include "../gradients/gradient.h"

namespace kernels {

// Smooth along the first two dimensions: waves of about `length` pixels, with values from low to high.
inline Halide::Buffer<real> make_waves(const std::vector<int>& sizes, float low, float high,
                                       float length) {
  Halide::Buffer<real> waves(sizes);
  for (size_t i = 0; i < waves.number_of_elements(); i++) {
    const size_t x = i % sizes[0], y = i / sizes[0] % sizes[1], c = i / sizes[0] / sizes[1];
    const double turn = 6.283185307179586 / length, phase = 2.4 * static_cast<double>(c);
    const double along = turn * (0.8 * static_cast<double>(x) + 0.6 * static_cast<double>(y));
    const double across = turn * (0.5 * static_cast<double>(y) - 0.7 * static_cast<double>(x));
    const double wave = 0.6 * std::sin(along + phase) + 0.4 * std::sin(across - 3 * phase);
    waves.data()[i] = static_cast<float>(low + (high - low) * (0.5 + 0.5 * wave));
  }
  return waves;
}

// Odd multiples of half a step of 1 / steps. float32 and float64 then find the same neighbours: at an integer, the
// gradient with respect to a position jumps.
inline Halide::Buffer<real> off_grid(Halide::Buffer<real> values, float steps) {
  values.for_each_value([=](real& v) { v = (std::floor(v * steps) + 0.5f) / steps; });
  return values;
}

// Bilinear interpolation of an image at (u, v) inside it; `rest` are its other indices.
template <typename Image>
Halide::Expr bilinear(const Image& image, const Halide::Expr& u, const Halide::Expr& v, int width,
                      int height, const std::vector<Halide::Expr>& rest) {
  using Halide::Expr;
  auto at = [&](const Expr& x, const Expr& y) -> Expr {
    std::vector<Expr> place{x, y};
    place.insert(place.end(), rest.begin(), rest.end());
    return image(place);
  };
  Expr x0 = clamp(cast<int>(floor(u)), 0, width - 1), x1 = min(x0 + 1, width - 1);
  Expr y0 = clamp(cast<int>(floor(v)), 0, height - 1), y1 = min(y0 + 1, height - 1);
  Expr wx = u - floor(u), wy = v - floor(v);
  return lerp(lerp(at(x0, y0), at(x1, y0), wx), lerp(at(x0, y1), at(x1, y1), wx), wy);
}

}  // namespace kernels
