#include "photographs.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

#include "diagnostics/error.h"

namespace demosaic {

using retrograde::quoted;
using retrograde::text;

namespace {

constexpr const char* list_name = "photographs.txt";
constexpr size_t held_out_every = 4;

[[noreturn]] void refuse_list(const std::filesystem::path& list, const std::string& evidence) {
  retrograde::call_error(text("read the list of photographs ", quoted(list.string())),
                         "each of its lines is \"train FILE\" or \"held_out FILE\"", evidence,
                         "Correct it, or take it away: then every fourth photograph is held out");
}

void read_list(const std::filesystem::path& folder, Dataset& dataset) {
  const auto list = folder / list_name;
  std::ifstream file(list);
  std::string line;
  while (std::getline(file, line)) {
    std::istringstream words(line.substr(0, line.find('#')));
    std::string kind, name;
    if (!(words >> kind)) continue;
    if (!(words >> name) || (kind != "train" && kind != "held_out")) {
      refuse_list(list, text("it has the line ", quoted(line)));
    }
    auto& to = kind == "train" ? dataset.train : dataset.held_out;
    to.push_back(read_photograph(folder / name));
  }
  dataset.division = text("as ", list_name, " says");
}

void divide_by_name(const std::filesystem::path& folder, Dataset& dataset) {
  const auto files = apps::images_in(folder);
  for (size_t n = 0; n < files.size(); ++n) {
    const bool held_out = n % held_out_every == held_out_every - 1 || n + 1 == files.size();
    (held_out ? dataset.held_out : dataset.train).push_back(read_photograph(files[n]));
  }
  dataset.division = "every fourth by name, and the last, are held out";
}

}  // namespace

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
  Dataset dataset;
  if (std::filesystem::exists(folder / list_name)) {
    read_list(folder, dataset);
  } else {
    divide_by_name(folder, dataset);
  }
  if (dataset.train.empty() || dataset.held_out.empty()) {
    retrograde::call_error(
        text("learn from the photographs in ", quoted(folder.string())),
        "some are learned from and others are measured on, so that there are two at least",
        text("there are ", dataset.train.size(), " to learn from and ", dataset.held_out.size(),
             " to measure on"),
        "Add photographs");
  }
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
