// noise.h -- estimates the noise of the frames, and the smoothness that it requires.
#pragma once

#include <optional>

#include "burst.h"
#include "objective.h"

namespace burst {

// Estimates the standard deviation of the noise of single frames, from areas with little texture. It uses second
// differences along both axes at once of samples of one colour, which cancel planes and gentle waves (J. Immerkaer,
// Fast noise variance estimation, Computer Vision and Image Understanding 64 (2), 1996). Immerkaer takes the mean
// magnitude. Ours takes the median over squares of 16 x 16 samples in all frames, and uses the tenth of the squares
// with the smallest medians: textures look like noise, but few pictures have them everywhere. Clipped samples do not
// count. For photographs that are textured everywhere the estimate is too large, up to twice.
double estimate_noise(const Burst& burst);

// Estimates it from aligned frames: the median magnitude of the residuals of a picture fitted to them. A pixel's three
// colours absorb the noise of three of its samples (it has one in each frame), which is corrected for; so there must be
// more than three frames. x: as in evaluator.h.
double estimate_noise(const Burst& burst, std::span<const float> x);

// The colour axes along which the picture is smooth.
enum class Colours {
  Rgb,       // red, green and blue separately
  Opponent,  // light, red against blue, green against both: nearly independent in photographs
};
// Orthogonal unit vectors.
std::array<std::array<double, 3>, 3> axes_of(Colours colours);

// The mean magnitude of the differences of neighbours along x and y, for the planes' colours projected on an axis.
// planes: [3, height, width].
double mean_difference(std::span<const float> planes, const FrameSize& size,
                       const std::array<double, 3>& axis);

// The weight of each axis by maximum a posteriori estimation: with normal noise and differences that are exponential
// with mean m, the most probable picture minimizes |residuals|^2 + 2 noise^2 / m |differences|_1. m is measured in
// `planes`, and is at least 1e-3. `given` replaces the weight: of all axes of Rgb, or of the first axis of Opponent,
// the others in proportion; 0: no smoothness.
Smoothness smoothness_for(double noise, std::span<const float> planes, const FrameSize& size,
                          Colours colours, std::optional<double> given);

}  // namespace burst
