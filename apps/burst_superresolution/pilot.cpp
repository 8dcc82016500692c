// pilot.cpp -- see pilot.h.
#include "pilot.h"

#include <chrono>

#include "common/adam.h"
#include "common/stop.h"
#include "fit.h"

namespace burst {

namespace {

constexpr int pilot_steps = 30;
constexpr double pilot_weight = 1e-3;
// The fit absorbs the noise of three samples per pixel, so with fewer frames hardly any noise remains to be measured.
constexpr int least_frames = 5;

// The point that a few steps reach from the initial one.
std::vector<float> explained(const Prepared& prepared, Evaluator<float>& evaluator) {
  std::vector<float> x = joined(prepared.first, prepared.homographies), gradient(x.size());
  apps::Adam adam({{evaluator.shape().image_elems(), image_rate},
                   {evaluator.shape().motion_elems(), motion_rate}},
                  {.schedule = apps::exponential_schedule(pilot_steps, last_rate)});
  for (int step = 0; step < pilot_steps && !apps::stop_requested(); ++step) {
    const double loss = evaluator.evaluate(x, gradient);
    adam.step(std::span<float>(x), loss, std::span<const float>(gradient));
  }
  return x;
}

}  // namespace

void choose_smoothness(const Options& options, const Burst& burst, Prepared& prepared,
                       Evaluator<float>& evaluator) {
  if (burst.frames() < least_frames || !options.moves.image || options.lambda) return;
  const auto start = std::chrono::steady_clock::now();
  Smoothness little = prepared.smoothness;
  for (ColourAxis& axis : little) axis.weight = pilot_weight;
  evaluator.set_smoothness(little);
  prepared.noise = estimate_noise(burst, explained(prepared, evaluator));
  prepared.smoothness =
      smoothness_for(prepared.noise, prepared.average, burst.size, options.colours, {});
  evaluator.set_smoothness(prepared.smoothness);
  prepared.seconds +=
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace burst
