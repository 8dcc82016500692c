// simulation.cpp -- see simulation.h.
#include "simulation.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "bicubic.h"
#include "diagnostics/error.h"

namespace burst {

using retrograde::quoted;
using retrograde::text;

namespace {

// Used instead of the standard library's distributions, whose numbers differ between implementations.
class Chance {
 public:
  explicit Chance(uint64_t seed) : random_(seed) {}
  // In [0, 1).
  double unit() { return static_cast<double>(random_() >> 11) * 0x1p-53; }
  double within(double bound) { return (2 * unit() - 1) * bound; }
  // G. Box, M. Muller, A note on the generation of random normal deviates, 1958.
  double normal() {
    const double radius = std::sqrt(-2 * std::log(1 - unit()));
    return radius * std::cos(2 * M_PI * unit());
  }

 private:
  std::mt19937_64 random_;
};

// At least the largest displacement of any pixel, plus the reach of the interpolation.
int border_of(const FrameSize& size, const Simulation& s) {
  const double diagonal = std::hypot(size.width, size.height) / 2;
  const double turned = 2 * std::sin(s.rotation * M_PI / 360) + s.zoom + 4 * s.tilt;
  return static_cast<int>(std::ceil(s.shake * M_SQRT2 + turned * diagonal)) + 2;
}

Homography random_motion(Chance& chance, const FrameSize& size, const Simulation& s) {
  const double angle = chance.within(s.rotation * M_PI / 180), zoom = 1 + chance.within(s.zoom);
  const double c = zoom * std::cos(angle), d = zoom * std::sin(angle);
  const double across = chance.within(s.shake), down = chance.within(s.shake);
  return {c - 1,
          -d,
          across / size.scale(),
          d,
          c - 1,
          down / size.scale(),
          chance.within(s.tilt),
          chance.within(s.tilt)};
}

// The part of the photograph that the first frame sees; it begins at even coordinates.
struct Cut {
  int left, top;
  FrameSize size;
};

Cut cut_of(const demosaic::Photograph& photograph, const Simulation& s, int border) {
  const auto side = [&](int whole) {
    const int most = whole - 2 * border;
    return (s.frame_size > 0 ? std::min(most, s.frame_size) : most) / 2 * 2;
  };
  const FrameSize size{side(photograph.width), side(photograph.height)};
  if (size.width < least_side || size.height < least_side) {
    retrograde::call_error(
        text("make a burst of ", quoted(photograph.name)),
        text("a frame needs ", least_side, " x ", least_side, " pixels and a border of ", border,
             " around it, because the camera moves"),
        text("the photograph has ", photograph.width, " x ", photograph.height),
        "Give a larger photograph, or less --shake and --rotation");
  }
  return {(photograph.width - size.width) / 4 * 2, (photograph.height - size.height) / 4 * 2, size};
}

std::vector<float> cut_planes(const demosaic::Photograph& photograph, const Cut& cut) {
  std::vector<float> planes;
  planes.reserve(3 * cut.size.pixels());
  for (int c = 0; c < 3; ++c) {
    for (int y = 0; y < cut.size.height; ++y) {
      for (int x = 0; x < cut.size.width; ++x)
        planes.push_back(photograph.at(cut.left + x, cut.top + y, c));
    }
  }
  return planes;
}

void add_frame(Burst& burst, const demosaic::Photograph& photograph, const Cut& cut,
               const Homography& h, double noise, Chance& chance) {
  const std::span<const float> all(photograph.planes);
  for (int y = 0; y < cut.size.height; ++y) {
    for (int x = 0; x < cut.size.width; ++x) {
      const Place at = place_of(h, cut.size, x, y);
      const auto c = static_cast<size_t>(demosaic::colour_at(x, y));
      const double seen =
          bicubic(all.subspan(c * photograph.pixels(), photograph.pixels()), photograph.width,
                  photograph.height, cut.left + at.x, cut.top + at.y);
      const double sample = noise > 0 ? seen + noise * chance.normal() : seen;
      burst.samples.push_back(static_cast<float>(std::clamp(sample, 0.0, 1.0)));
    }
  }
}

}  // namespace

Burst simulate(const demosaic::Photograph& photograph, const Simulation& simulation) {
  const int border = border_of({photograph.width, photograph.height}, simulation);
  const Cut cut = cut_of(photograph, simulation, border);
  Burst burst;
  burst.size = cut.size;
  burst.bits = photograph.bits;
  burst.truth.emplace();
  burst.truth->planes = cut_planes(photograph, cut);
  burst.truth->noise = simulation.noise;
  // A picture no larger than its border is measured where that is possible.
  burst.truth->border = std::min(border, std::min(cut.size.width, cut.size.height) / 4);
  Chance chance(simulation.seed);
  for (int n = 0; n < simulation.frames; ++n) {
    const Homography h = n == 0 ? Homography{} : random_motion(chance, cut.size, simulation);
    burst.truth->homographies.push_back(h);
    burst.names.push_back(text("frame ", n));
    add_frame(burst, photograph, cut, h, simulation.noise, chance);
  }
  return burst;
}

}  // namespace burst
