// simulation.h -- simulates a burst from a photograph, so that the true picture and homographies are known.
//
//   frame_n(x, y) = clamp(bicubic(photograph, H_n (x, y)) at the mosaic's colour + noise, 0, 1)
//
// H_n is a shift, a rotation, a change of size and a tilt, each uniformly random within its bounds; H_0 is the
// identity. Frames are cropped so that none looks beyond the photograph.
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
  int frame_size = 0;    // largest size of frames along each side; 0: as large as possible
  uint64_t seed = 1;
};

// Throws retrograde::UserError if the photograph is too small.
Burst simulate(const demosaic::Photograph& photograph, const Simulation& simulation);

}  // namespace burst
