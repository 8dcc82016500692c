// checks.h -- --check-gradients, --check-stability and --explain: a run that does one of them writes its
// report and prints its table.
#pragma once

#include "options.h"

namespace demosaic {

// On a piece of the input, or of the dataset's first photograph. Throws retrograde::UserError where an
// error is larger than apps/common/checks.h allows.
void check_gradients(const Options& options);

// Frames that are black, saturated, clipped and nearly empty: image and gradient in float32 against
// double, and whether Adam diverges there.
void check_stability(const Options& options);

// What learning computes for the groups of --optimize, and what it leaves out.
void explain(const Options& options);

}  // namespace demosaic
