// noise.h -- how noisy frames are, and how much smoothness that asks for.
#pragma once

#include <optional>

#include "burst.h"
#include "objective.h"

namespace burst {

// The standard deviation of the noise of single frames, where it is plainest to see: second differences along both axes at once of
// samples of one colour, which leave planes and gentle waves out (J. Immerkaer, Fast noise variance estimation,
// Computer Vision and Image Understanding 64 (2), 1996). Ours takes their median magnitude, where he has the mean,
// over squares of 16 x 16 samples in all frames, and of the squares the tenth part with the least: textures look
// like noise, but few pictures have them everywhere. Samples at the ends of the range, where noise is cut off,
// do not count. Of photographs that are textured everywhere it is too large, up to twice.
double estimate_noise(const Burst& burst);

// The same of aligned frames: the median magnitude of what a picture, fitted to them, leaves unexplained. A pixel's
// three colours follow as many of its samples' noise, one in each frame, which is put right: there must be more
// frames than three. x: as of evaluator.h.
double estimate_noise(const Burst& burst, std::span<const float> x);

// Which colours are smooth.
enum class Colours {
  Rgb,       // red, green and blue, each by itself
  Opponent,  // light, red against blue, green against both: nearly independent in photographs
};
// Unit vectors, at right angles.
std::array<std::array<double, 3>, 3> axes_of(Colours colours);

// The mean magnitude of the differences of neighbours along x and y, of the planes' colours along an axis.
// planes: [3, height, width].
double mean_difference(std::span<const float> planes, const FrameSize& size,
                       const std::array<double, 3>& axis);

// Samples with normal noise and differences that are exponential with mean m are most probable where
// |residuals|^2 + 2 noise^2 / m |differences|_1 is least (maximum a posteriori): that is each axis' weight, with m
// measured in `planes`, but 1e-3 at least. With `given`, all of Rgb have that weight, or the first of
// Opponent, and its others in proportion; 0: no smoothness.
Smoothness smoothness_for(double noise, std::span<const float> planes, const FrameSize& size,
                          Colours colours, std::optional<double> given);

}  // namespace burst
