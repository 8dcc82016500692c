// noise.h -- how noisy frames are, and how much smoothness that asks for.
#pragma once

#include "burst.h"

namespace burst {

// The standard deviation of the noise: of each colour plane of each mosaic, the second differences along both
// axes at once, which leave planes and gentle waves out (J. Immerkaer, Fast noise variance estimation, Computer
// Vision and Image Understanding 64 (2), 1996); ours takes their median magnitude, where he has the mean, so that
// edges hardly count, and leaves out what lies at the ends of the range, where noise is cut off.
double estimate_noise(const Burst& burst);

// The mean magnitude of the differences of neighbours along x and y, in all colours. planes: [3, height, width].
double mean_difference(std::span<const float> planes, const FrameSize& size);

// The weight of the smoothness: samples with normal noise of this strength and differences that are exponential
// with this mean are most probable where  |samples|^2 + 2 noise^2 / mean |differences|_1  is least (maximum a
// posteriori). Never below 1e-3.
double smoothness_for(double noise, double mean_difference);

}  // namespace burst
