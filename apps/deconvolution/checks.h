// checks.h -- --check-gradients, --check-stability and --explain: a run that does one of them writes its
// report and prints its table.
#pragma once

#include <vector>

#include "common/checks.h"
#include "demosaic/photographs.h"
#include "options.h"

namespace deconvolution {

// A small batch, and weights that make the minimum of each energy exact to the last digits. Throw
// retrograde::UserError for photographs that are too small.
//
// The energy of a stage by its image, by the library's check: what the conjugate gradients start from.
std::vector<apps::GradientRow> energy_gradients(
    const std::vector<demosaic::Photograph>& photographs, uint64_t seed);
// The loss behind two stages by their numbers: implicit, against differences of whole solutions.
std::vector<apps::GradientRow> loss_gradients(const std::vector<demosaic::Photograph>& photographs,
                                              uint64_t seed, int threads);
// Frames that are black, saturated, noise: image and gradient in float32 against double, and whether so many steps
// of Adam diverge there.
std::vector<apps::StabilityRow> stability_rows(uint64_t seed, int threads, long steps);

// Throws retrograde::UserError where an error is larger than apps/common/checks.h allows.
void check_gradients(const Options& options);
void check_stability(const Options& options);
// What learning computes, and what it leaves out.
void explain(const Options& options);

}  // namespace deconvolution
