// prepare.cpp -- see prepare.h.
#include "prepare.h"

#include <chrono>
#include <cmath>

#include "average.h"
#include "demosaic/demosaicker.h"
#include "diagnostics/error.h"
#include "registration.h"

namespace burst {

namespace {

class Stopwatch {
 public:
  double seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

// Two frames of the same scene differ by 1.13 times the noise on average; quantisation to 8 bits adds a little.
bool are_alike(std::span<const float> a, std::span<const float> b, double noise) {
  double sum = 0;
  for (size_t n = 0; n < a.size(); ++n) sum += std::abs(a[n] - b[n]);
  return sum / static_cast<double>(a.size()) <= 1.3 * noise + 1.0 / 255;
}

std::vector<float> demosaicked(demosaic::Demosaicker& ahd, const Burst& burst, int n) {
  const auto frame = burst.frame(n);
  std::vector<float> mosaic(frame.begin(), frame.end());
  return ahd.run(mosaic, burst.size.width, burst.size.height);
}

}  // namespace

Prepared prepare(Burst& burst, Colours colours, std::optional<double> lambda, int threads) {
  const Stopwatch watch;
  Prepared prepared;
  prepared.noise = estimate_noise(burst);
  demosaic::Demosaicker ahd = demosaic::Demosaicker::ahd(threads);
  prepared.first = demosaicked(ahd, burst, 0);
  prepared.seconds_to_first = watch.seconds();
  prepared.homographies.push_back({});
  BicubicAverage average(burst.size);
  average.add(prepared.first, {});
  const Registration registration(prepared.first, burst.size);
  std::vector<int> lost;
  for (int n = 1; n < burst.frames(); ++n) {
    const std::vector<float> picture = demosaicked(ahd, burst, n);
    std::optional<Homography> motion = registration.motion_of(picture);
    if (!motion && are_alike(burst.frame(0), burst.frame(n), prepared.noise)) motion = Homography{};
    if (motion) {
      prepared.homographies.push_back(*motion);
      average.add(picture, *motion);
    } else {
      lost.push_back(n);
      burst.notes.push_back(retrograde::text(burst.names[static_cast<size_t>(n)],
                                             " is left out: it cannot be aligned with the first"));
    }
  }
  burst.leave_out(lost);
  prepared.average = average.take();
  prepared.seconds_to_average = watch.seconds();
  prepared.smoothness =
      smoothness_for(prepared.noise, prepared.average, burst.size, colours, lambda);
  prepared.seconds = watch.seconds();
  return prepared;
}

}  // namespace burst
