// prepare.h -- from frames to where the optimization starts, and what it is measured beside.
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
  // Since the frames were there.
  double seconds_to_first = 0, seconds_to_average = 0, seconds = 0;
};

// Frames that cannot be aligned are left out of the burst, which then has a note of it; but where they are, up to
// noise, what the first is, their motion is none. The weights of the smoothness are those of noise.h. Throws
// retrograde::Error.
Prepared prepare(Burst& burst, Colours colours, std::optional<double> lambda, int threads);

}  // namespace burst
