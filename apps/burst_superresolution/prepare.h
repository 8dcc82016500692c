// prepare.h -- prepares the optimization from the frames: its initial point, and the baselines for comparison.
#pragma once

#include <optional>
#include <vector>

#include "burst.h"
#include "noise.h"

namespace burst {

struct Prepared {
  std::vector<float>
      first;  // the first frame, demosaicked by AHD (apps/demosaic): [3, height, width]
  std::vector<float> average;            // the bicubic average of all frames
  std::vector<Homography> homographies;  // of each frame
  double noise = 0;
  Smoothness smoothness;
  // Measured from the time when the frames were read.
  double seconds_to_first = 0, seconds_to_average = 0, seconds = 0;
};

// Frames that cannot be aligned are removed from the burst, which gets a note about it. But if they equal the first
// frame up to noise, they have no motion and stay. The smoothness' weights are those of noise.h. Throws
// retrograde::Error.
Prepared prepare(Burst& burst, Colours colours, std::optional<double> lambda, int threads);

}  // namespace burst
