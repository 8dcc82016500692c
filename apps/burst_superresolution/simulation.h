// simulation.h -- a burst made of a photograph, so that picture and homographies are known.
//
//   frame_n(x, y) = clamp(bicubic(photograph, H_n (x, y)) at the mosaic's colour + noise, 0, 1)
//
// H_n is a shift, a turn, a change of size and a tilt, each even at random within its bounds; H_0 is the
// identity. Frames are cut so far within the photograph that none looks beyond it.
#pragma once

#include <cstdint>

#include "burst.h"
#include "demosaic/photographs.h"

namespace burst {

struct Simulation {
  int frames = 13;
  double shake = 8;      // pixels, along x and y each
  double rotation = 1;   // degrees
  double zoom = 0.002;   // relative
  double tilt = 0.002;   // h6 and h7
  double noise = 0.005;  // standard deviation of each sample
  int frame_size =
      0;  // frames are cut to so many pixels along each side at most; 0: as large as may be
  uint64_t seed = 1;
};

// Throws retrograde::UserError where the photograph is too small.
Burst simulate(const demosaic::Photograph& photograph, const Simulation& simulation);

}  // namespace burst
