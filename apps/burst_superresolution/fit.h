// fit.h -- the optimization: Adam steps on the picture and the homographies, from an initial point, until the steps are
// done, the time limit is reached or the user stops it.
#pragma once

#include <functional>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "burst.h"
#include "evaluator.h"
#include "options.h"
#include "prepare.h"

namespace burst {

// Adam's rates for the first step; they fall by a constant factor to `last_rate` times that.
inline constexpr double image_rate = 1e-2, motion_rate = 1e-4, last_rate = 0.1;

// The state after `step` steps; quality is NaN unless the truth is known.
struct Sample {
  long step = 0;
  double seconds = 0;  // of optimization
  double loss = 0;
  double psnr_db = std::numeric_limits<double>::quiet_NaN();
  double motion_error = std::numeric_limits<double>::quiet_NaN();  // pixels, mean
};

struct Fit {
  std::vector<float> x;  // the best point: the picture, then the homographies (evaluator.h)
  double loss = std::numeric_limits<double>::infinity();
  std::vector<Sample> series;  // from the start
  long steps = 0, refused = 0;
  double seconds = 0, ms_per_step = 0;  // ms_per_step: the median
  bool stopped = false;

  std::span<const float> picture(const Shape& shape) const {
    return std::span(x).first(shape.image_elems());
  }
  std::vector<Homography> homographies(const Shape& shape) const;
};

// The vector x for a picture and homographies.
std::vector<float> joined(std::span<const float> picture, std::span<const Homography> homographies);

// Saves options.common.output / "state.bin" every twenty seconds and at the end; --resume continues from it. `shown` is
// called with each step's sample. Throws retrograde::Error.
Fit fit(const Options& options, const Burst& burst, const Prepared& prepared,
        Evaluator<float>& evaluator, const std::function<void(const Sample&)>& shown);

}  // namespace burst
