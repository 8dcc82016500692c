// one_picture.h -- demosaics the input: a mosaic, or a picture that is sampled as one and compared.
#pragma once

#include "common/report.h"
#include "options.h"
#include "weights.h"

namespace demosaic {

// Writes result.png into the output folder, and result.exr when the input holds floats; of a picture also the
// mosaic and what the other methods make of it, and enters all of it. Throws retrograde::Error.
void demosaic_input(const Options& options, const Weights& weights, apps::Report& report);

}  // namespace demosaic
