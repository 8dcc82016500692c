// prepare.h -- from frames to where the optimization starts, and what it is measured beside.
#pragma once

#include <optional>
#include <vector>

#include "burst.h"

namespace burst {

struct Prepared {
  std::vector<float>
      first;  // the first frame, demosaicked by AHD (apps/demosaic): [3, height, width]
  std::vector<float> average;            // the bicubic average of all frames
  std::vector<Homography> homographies;  // of each frame
  double noise = 0, smoothness = 0;
  // Since the frames were there.
  double seconds_to_first = 0, seconds_to_average = 0, seconds = 0;
};

// Frames that cannot be aligned are left out of the burst, which then has a note of it; but where they are, up to
// noise, what the first is, their motion is none. `smoothness`: given, or as noise.h has it. Throws
// retrograde::Error.
Prepared prepare(Burst& burst, std::optional<double> smoothness, int threads);

}  // namespace burst
