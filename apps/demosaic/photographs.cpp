#include "photographs.h"

#include <algorithm>
#include <cmath>

#include "common/division.h"
#include "diagnostics/error.h"

namespace demosaic {

using retrograde::quoted;
using retrograde::text;

float encoded(float light) {
  const float v = std::clamp(light, 0.0f, 1.0f);
  return v <= 0.0031308f ? 12.92f * v : 1.055f * std::pow(v, 1 / 2.4f) - 0.055f;
}

float decoded(float value) {
  return value <= 0.04045f ? value / 12.92f : std::pow((value + 0.055f) / 1.055f, 2.4f);
}

int mirrored(int v, int n) {
  if (n == 1) return 0;
  const int period = 2 * (n - 1);
  const int place = ((v % period) + period) % period;
  return place < n ? place : period - place;
}

Photograph read_photograph(const std::filesystem::path& path) {
  const apps::Image image = apps::read_image(path);
  if (image.width < 2 || image.height < 2) {
    retrograde::call_error(text("demosaic ", quoted(path.string())),
                           "a picture needs a whole cell of the mosaic, 2 x 2 pixels",
                           text("it has ", image.width, " x ", image.height),
                           "Give a larger picture");
  }
  Photograph photograph{path.filename().string(), image.width, image.height, image.bits, {}};
  photograph.planes.resize(3 * photograph.pixels());
  const bool is_light = image.bits == 32;
  for (size_t n = 0; n < photograph.pixels(); ++n) {
    for (size_t c = 0; c < 3; ++c) {
      const float value = image.pixels[3 * n + c];
      photograph.planes[c * photograph.pixels() + n] =
          is_light ? encoded(value) : std::clamp(value, 0.0f, 1.0f);
    }
  }
  return photograph;
}

apps::Image image_of(int width, int height, int bits, std::span<const float> planes) {
  apps::Image image{width, height, bits, {}};
  const size_t pixels = planes.size() / 3;
  image.pixels.resize(planes.size());
  for (size_t n = 0; n < pixels; ++n) {
    for (size_t c = 0; c < 3; ++c) image.pixels[3 * n + c] = planes[c * pixels + n];
  }
  return image;
}

std::vector<float> mosaic_of(const Photograph& photograph) {
  std::vector<float> mosaic;
  mosaic.reserve(photograph.pixels());
  for (int y = 0; y < photograph.height; ++y) {
    for (int x = 0; x < photograph.width; ++x) {
      mosaic.push_back(photograph.at(x, y, colour_at(x, y)));
    }
  }
  return mosaic;
}

Dataset read_dataset(const std::filesystem::path& folder) {
  const apps::Division division = apps::division_of(folder);
  Dataset dataset{.division = division.words};
  for (const auto& file : division.train) dataset.train.push_back(read_photograph(file));
  for (const auto& file : division.held_out) dataset.held_out.push_back(read_photograph(file));
  return dataset;
}

Quality quality(const Photograph& truth, std::span<const float> planes) {
  double encoded_sum = 0, linear_sum = 0;
  for (size_t n = 0; n < planes.size(); ++n) {
    const float value = std::clamp(planes[n], 0.0f, 1.0f);
    const double difference = value - truth.planes[n];
    const double in_light = static_cast<double>(decoded(value)) - decoded(truth.planes[n]);
    encoded_sum += difference * difference;
    linear_sum += in_light * in_light;
  }
  const auto db = [&](double sum) {
    return -10 * std::log10(std::max(sum / static_cast<double>(planes.size()), 1e-12));
  };
  return {db(encoded_sum), db(linear_sum)};
}

}  // namespace demosaic
