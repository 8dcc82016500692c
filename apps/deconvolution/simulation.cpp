// simulation.cpp -- see simulation.h.
#include "simulation.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace deconvolution {

namespace {

// For positions at which k lies within the image: [height - size + 1, width - size + 1].
std::vector<float> blurred(const Plane& sharp, const Psf& psf) {
  const int width = sharp.width - psf.size + 1, height = sharp.height - psf.size + 1;
  std::vector<float> result(static_cast<size_t>(width) * static_cast<size_t>(height), 0.0f);
  for (int y = 0; y < height; ++y) {
    float* to = result.data() + static_cast<size_t>(y) * static_cast<size_t>(width);
    for (int v = 0; v < psf.size; ++v) {
      for (int u = 0; u < psf.size; ++u) {
        const float share = psf.at(u, v);
        if (share == 0) continue;
        const float* from =
            sharp.samples.data() +
            static_cast<size_t>(y + psf.size - 1 - v) * static_cast<size_t>(sharp.width) +
            (psf.size - 1 - u);
        for (int x = 0; x < width; ++x) to[x] += share * from[x];
      }
    }
  }
  return result;
}

}  // namespace

double Random::normal() {  // G. Box, M. Muller, Annals of Mathematical Statistics 29, 1958
  const double radius = std::sqrt(-2 * std::log(1 - uniform()));
  return radius * std::cos(2 * std::numbers::pi * uniform());
}

Plane Plane::part(int left, int top, int w, int h) const {
  Plane result{w, h, {}};
  for (int y = 0; y < h; ++y) {
    const auto row = samples.begin() + static_cast<long>(top + y) * width + left;
    result.samples.insert(result.samples.end(), row, row + w);
  }
  return result;
}

Plane luma_of(const demosaic::Photograph& photograph) {
  Plane result{photograph.width, photograph.height, {}};
  const size_t pixels = photograph.pixels();
  const float* red = photograph.planes.data();
  for (size_t k = 0; k < pixels; ++k) {
    result.samples.push_back(0.299f * red[k] + 0.587f * red[pixels + k] +
                             0.114f * red[2 * pixels + k]);
  }
  return result;
}

Plane channel_of(const demosaic::Photograph& photograph, int channel) {
  const auto pixels = static_cast<long>(photograph.pixels());
  const auto from = photograph.planes.begin() + channel * pixels;
  return {photograph.width, photograph.height, {from, from + pixels}};
}

void Simulated::add(const Plane& sharp, const Psf& psf, double noise, Random& random) {
  Extent& e = problem.extent;
  const int margin = psf.size / 2;
  if (problem.noises.empty())
    e = {sharp.width - 2 * margin, sharp.height - 2 * margin, 0, psf.size};
  ++e.count;
  for (const float value : blurred(sharp, psf)) {
    problem.blurred.push_back(value + static_cast<float>(noise * random.normal()));
  }
  problem.psfs.insert(problem.psfs.end(), psf.samples.begin(), psf.samples.end());
  problem.noises.push_back(static_cast<float>(noise));
  const Plane inner = sharp.part(margin, margin, e.width, e.height);
  truth.insert(truth.end(), inner.samples.begin(), inner.samples.end());
}

double psnr_db(std::span<const float> image, std::span<const float> truth) {
  double sum = 0;
  for (size_t k = 0; k < image.size(); ++k) {
    const double difference = std::clamp(image[k], 0.0f, 1.0f) - truth[k];
    sum += difference * difference;
  }
  return -10 * std::log10(std::max(sum / static_cast<double>(image.size()), 1e-12));
}

std::vector<double> each_psnr_db(const std::vector<float>& images, const Simulated& simulated) {
  std::vector<double> result;
  const auto count = static_cast<size_t>(simulated.problem.extent.count);
  const size_t each = images.size() / count;
  for (size_t k = 0; k < count; ++k) {
    result.push_back(psnr_db(std::span(images).subspan(k * each, each),
                             std::span(simulated.truth).subspan(k * each, each)));
  }
  return result;
}

}  // namespace deconvolution
