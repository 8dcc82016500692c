// psf.cpp -- see psf.h.
#include "psf.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <random>
#include <span>

#include "common/images.h"
#include "diagnostics/error.h"

namespace deconvolution {

using retrograde::quoted;
using retrograde::text;

namespace {

[[noreturn]] void refuse(const std::string& what, const std::string& evidence) {
  retrograde::call_error(text("take ", quoted(what), " as a point-spread function"),
                         text("it is \"disc:RADIUS\", \"motion:SIZE\", \"motion:SIZE:SEED\" or an "
                              "image file whose brightness is the function, of at most ",
                              most_psf_size, " samples a side"),
                         evidence, "Give one of these");
}

Psf normalised(std::string name, int size, const std::vector<double>& samples) {
  double sum = 0;
  for (const double value : samples) sum += value;
  Psf psf{std::move(name), size, {}};
  for (const double value : samples) psf.samples.push_back(static_cast<float>(value / sum));
  return psf;
}

// Uniform numbers in [0, 1) and normal ones; the standard library's differ between implementations.
class Numbers {
 public:
  explicit Numbers(uint64_t seed) : random_(seed) {}
  double uniform() { return static_cast<double>(random_() >> 11) * 0x1p-53; }
  double normal() {  // G. Box, M. Muller, Annals of Mathematical Statistics 29, 1958
    const double radius = std::sqrt(-2 * std::log(1 - uniform()));
    return radius * std::cos(2 * std::numbers::pi * uniform());
  }

 private:
  std::mt19937_64 random_;
};

struct Point {
  double x = 0, y = 0;
};

std::vector<Point> shaken_path(uint64_t seed) {
  constexpr int steps = 600;
  constexpr double pull = 0.02, rest = 0.004, push = 0.15, jerks = 3;
  Numbers numbers(seed);
  const double angle = 2 * std::numbers::pi * numbers.uniform();
  Point at, speed{3 * std::cos(angle), 3 * std::sin(angle)};
  std::vector<Point> path;
  for (int k = 0; k < steps; ++k) {
    const double strength = numbers.uniform() < jerks / steps ? 30 * push : push;
    speed.x += strength * numbers.normal() - pull * speed.x - rest * at.x;
    speed.y += strength * numbers.normal() - pull * speed.y - rest * at.y;
    at.x += 0.1 * speed.x;
    at.y += 0.1 * speed.y;
    path.push_back(at);
  }
  return path;
}

// Centres the path on its mean and scales it to fit [-reach, reach].
void fit(std::vector<Point>& path, double reach) {
  Point mean;
  for (const Point& p : path) {
    mean.x += p.x / static_cast<double>(path.size());
    mean.y += p.y / static_cast<double>(path.size());
  }
  double furthest = 1e-9;
  for (Point& p : path) {
    p = {p.x - mean.x, p.y - mean.y};
    furthest = std::max({furthest, std::abs(p.x), std::abs(p.y)});
  }
  for (Point& p : path) p = {p.x * reach / furthest, p.y * reach / furthest};
}

std::optional<double> number_of(const std::string& word) {
  size_t used = 0;
  try {
    const double value = std::stod(word, &used);
    if (used == word.size() && std::isfinite(value)) return value;
  } catch (const std::exception&) {
  }
  return std::nullopt;
}

// A function from an image's brightness: the square around the bounding box of nonzero pixels.
Psf cut(const std::string& name, const apps::Image& image) {
  const auto value = [&](int x, int y) {
    const size_t from = 3 * static_cast<size_t>(y * image.width + x);
    return (static_cast<double>(image.pixels[from]) + image.pixels[from + 1] +
            image.pixels[from + 2]) /
           3;
  };
  int left = image.width, top = image.height, right = -1, bottom = -1;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      if (value(x, y) < 0) refuse(name, text("it is negative at (", x, ", ", y, ")"));
      if (value(x, y) == 0) continue;
      left = std::min(left, x), right = std::max(right, x);
      top = std::min(top, y), bottom = std::max(bottom, y);
    }
  }
  if (right < 0) refuse(name, "all of its samples are 0");
  const int size = std::max(right - left, bottom - top) / 2 * 2 + 1 +
                   (std::max(right - left, bottom - top) % 2 == 1 ? 2 : 0);
  if (size > most_psf_size) refuse(name, text("it has ", size, " samples along a side"));
  std::vector<double> samples;
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      const int column = left + x - (size - 1 - (right - left)) / 2;
      const int row = top + y - (size - 1 - (bottom - top)) / 2;
      const bool inside = column >= left && column <= right && row >= top && row <= bottom;
      samples.push_back(inside ? value(column, row) : 0);
    }
  }
  return normalised(name, size, samples);
}

}  // namespace

Psf defocus_disc(double radius) {
  constexpr int parts = 16;
  const int half = std::max(static_cast<int>(std::ceil(radius - 0.5)), 0), size = 2 * half + 1;
  std::vector<double> samples;
  for (int y = -half; y <= half; ++y) {
    for (int x = -half; x <= half; ++x) {
      int covered = 0;
      for (int v = 0; v < parts; ++v) {
        for (int u = 0; u < parts; ++u) {
          covered += std::hypot(x + (u + 0.5) / parts - 0.5, y + (v + 0.5) / parts - 0.5) <= radius;
        }
      }
      samples.push_back(covered);
    }
  }
  return normalised(text("disc:", radius), size, samples);
}

Psf motion_path(int size, uint64_t seed) {
  constexpr double lens = 0.4;  // pixels, standard deviation
  std::vector<Point> path = shaken_path(seed);
  const int half = size / 2;
  fit(path, std::max(half - 1.0, 0.0));
  std::vector<double> samples(static_cast<size_t>(size) * static_cast<size_t>(size), 0.0);
  for (const Point& p : path) {
    for (int y = 0; y < size; ++y) {
      for (int x = 0; x < size; ++x) {
        const double dx = x - half - p.x, dy = y - half - p.y;
        if (std::abs(dx) > 2.5 || std::abs(dy) > 2.5) continue;
        samples[static_cast<size_t>(y * size + x)] +=
            std::exp(-(dx * dx + dy * dy) / (2 * lens * lens));
      }
    }
  }
  return normalised(text("motion:", size, ":", seed), size, samples);
}

Psf read_psf(const std::filesystem::path& path) {
  return cut(path.string(), apps::read_image(path));
}

Psf psf_of(const std::string& description) {
  const size_t colon = description.find(':');
  const std::string kind = description.substr(0, colon);
  if (colon == std::string::npos || (kind != "disc" && kind != "motion"))
    return read_psf(description);
  const std::string rest = description.substr(colon + 1);
  const size_t second = rest.find(':');
  const auto first = number_of(rest.substr(0, second));
  if (!first) refuse(description, text(quoted(rest.substr(0, second)), " is not a number"));
  if (kind == "disc") {
    if (!(*first > 0 && *first <= most_psf_size / 2))
      refuse(description, text("its radius is ", *first, " pixels"));
    return defocus_disc(*first);
  }
  const int size = static_cast<int>(std::clamp(*first, -1.0, 1e6));
  if (size != *first || size < 3 || size > most_psf_size || size % 2 == 0)
    refuse(description,
           text("its size is ", *first, ", which is not odd or not in [3, ", most_psf_size, "]"));
  if (second == std::string::npos) return motion_path(size, 1);
  const auto seed = number_of(rest.substr(second + 1));
  if (!seed || *seed < 0 || *seed > 1e15 || *seed != std::floor(*seed))
    refuse(description, text(quoted(rest.substr(second + 1)), " is not a seed"));
  return motion_path(size, static_cast<uint64_t>(*seed));
}

Psf enlarged(const Psf& psf, int size) {
  if (size <= psf.size) return psf;
  Psf result{psf.name, size, std::vector<float>(static_cast<size_t>(size * size), 0.0f)};
  const int shift = (size - psf.size) / 2;
  for (int y = 0; y < psf.size; ++y) {
    for (int x = 0; x < psf.size; ++x) {
      result.samples[static_cast<size_t>((y + shift) * size + x + shift)] = psf.at(x, y);
    }
  }
  return result;
}

Psf mirrored(const Psf& psf, bool flip_x, bool flip_y, bool turned) {
  Psf result = psf;
  for (int y = 0; y < psf.size; ++y) {
    for (int x = 0; x < psf.size; ++x) {
      const int u = flip_x ? psf.size - 1 - x : x, v = flip_y ? psf.size - 1 - y : y;
      result.samples[static_cast<size_t>(y * psf.size + x)] = turned ? psf.at(v, u) : psf.at(u, v);
    }
  }
  return result;
}

}  // namespace deconvolution
