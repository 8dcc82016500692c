// checks.h -- --check-gradients, --check-stability and --explain; each writes its report and prints its table.
#pragma once

#include <vector>

#include "common/checks.h"
#include "demosaic/photographs.h"
#include "options.h"

namespace deconvolution {

// Both use a small batch, and weights with which the minimum of each energy is exact to the last digits. They throw
// retrograde::UserError if photographs are too small.
//
// The gradient of a stage's energy by its image, from which conjugate gradients start, by the library's check.
std::vector<apps::GradientRow> energy_gradients(
    const std::vector<demosaic::Photograph>& photographs, uint64_t seed);
// The gradient of the loss after two stages by their numbers: implicit differentiation, against differences of complete
// solutions.
std::vector<apps::GradientRow> loss_gradients(const std::vector<demosaic::Photograph>& photographs,
                                              uint64_t seed, int threads);
// Black, saturated and noisy frames: image and gradient in float32 against double, and whether `steps` steps of Adam
// diverge.
std::vector<apps::StabilityRow> stability_rows(uint64_t seed, int threads, long steps);

// Runs --check-gradients or --check-stability. Throws retrograde::UserError if an error exceeds the limits of
// apps/common/checks.h.
void check(const Options& options);
// Explains what learning computes, and what it leaves out.
void explain(const Options& options);

}  // namespace deconvolution
