// checks.h -- --check-gradients, --check-stability and --explain; each writes its report and prints its table.
#pragma once

#include "options.h"

namespace demosaic {

// --check-gradients: a piece of the input, or of the dataset's first photograph. Throws retrograde::UserError if an error
// exceeds the limits of apps/common/checks.h.
// --check-stability: black, saturated, clipped and nearly empty frames: image and gradient in float32 against double, and
// whether Adam diverges.
void check(const Options& options);

// Explains what learning computes for the groups of --optimize, and what it leaves out.
void explain(const Options& options);

}  // namespace demosaic
