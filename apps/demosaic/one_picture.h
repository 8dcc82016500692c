// one_picture.h -- demosaics the input: a mosaic, or a picture, which is sampled as a mosaic and compared with.
#pragma once

#include "common/report.h"
#include "options.h"
#include "weights.h"

namespace demosaic {

// Writes result.png to the output folder, and result.exr if the input holds floats. For a picture, also writes the
// mosaic and the other methods' results. Adds everything to the report. Throws retrograde::Error.
void demosaic_input(const Options& options, const Weights& weights, apps::Report& report);

}  // namespace demosaic
