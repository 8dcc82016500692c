// inexact.h -- what implicit differentiation costs where a solution is not exact.
#pragma once

#include <vector>

#include "common/report.h"
#include "demosaic/photographs.h"
#include "weights.h"

namespace deconvolution {

// Of the loss behind all stages, along directions of each stage's numbers, in double: what is implicit against
// differences of the loss with the same iterations, and against the exact gradient, as root mean squares relative
// to those of the second. A row for each number of iterations. Throws retrograde::UserError for photographs that are too small.
apps::Table inexact_solutions(const std::vector<demosaic::Photograph>& photographs,
                              const Weights& weights, uint64_t seed, int threads);

}  // namespace deconvolution
