// simulation.h -- simulates blurred and noisy images from photographs, so that the sharp pixels are known.
//
// Samples are sRGB-encoded and in [0, 1], as in the literature on deconvolution. Pixels within half a point-spread
// function of a photograph's border contribute to its blurred image but are not part of it, so no boundary condition is
// assumed.
#pragma once

#include <cstdint>
#include <random>
#include <span>
#include <vector>

#include "demosaic/photographs.h"
#include "psf.h"
#include "solver.h"

namespace deconvolution {

// Uniform and normal random numbers that are the same with every standard library.
class Random {
 public:
  explicit Random(uint64_t seed) : engine_(seed) {}
  double uniform() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }
  double uniform(double least, double most) { return least + (most - least) * uniform(); }
  int below(int n) { return static_cast<int>(engine_() % static_cast<uint64_t>(n)); }
  double normal();
  std::mt19937_64& engine() { return engine_; }

 private:
  std::mt19937_64 engine_;
};

// One channel, [height, width].
struct Plane {
  int width = 0, height = 0;
  std::vector<float> samples;

  float at(int x, int y) const {
    return samples[static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x)];
  }
  Plane part(int left, int top, int w, int h) const;
};

// Luma (ITU-R BT.601) of the encoded samples, or one of the three channels.
Plane luma_of(const demosaic::Photograph& photograph);
Plane channel_of(const demosaic::Photograph& photograph, int channel);

// Problems with their truth. All images have one size, and all functions the same number of samples.
struct Simulated {
  Problem problem;
  std::vector<float> truth;  // [count, height, width]: the sharp pixels at the problem's samples

  // Adds an image: `sharp` includes the margin; `noise` is a standard deviation.
  void add(const Plane& sharp, const Psf& psf, double noise, Random& random);
};

// 10 log10(1 / mean squared error) of the n-th image, clamped to [0, 1].
double psnr_db(std::span<const float> image, std::span<const float> truth);
std::vector<double> each_psnr_db(const std::vector<float>& images, const Simulated& simulated);

}  // namespace deconvolution
