// inexact.h -- measures the error of implicit differentiation if solutions are inexact.
#pragma once

#include <vector>

#include "common/report.h"
#include "demosaic/photographs.h"
#include "weights.h"

namespace deconvolution {

// Uses the loss after all stages, along directions of each stage's numbers, in double. The implicit derivative is
// compared with differences of the loss with the same iterations, and with the exact gradient, as root mean squares
// relative to those of the exact gradient. One row per number of iterations. Throws retrograde::UserError if
// photographs are too small.
apps::Table inexact_solutions(const std::vector<demosaic::Photograph>& photographs,
                              const Weights& weights, uint64_t seed, int threads);

}  // namespace deconvolution
