// tune.h -- tunes the numbers of the original method by a scan over the training photographs, without gradients.
#pragma once

#include "common/report.h"
#include "options.h"
#include "simulation.h"

namespace deconvolution {

// Starts from the published numbers. Multiplies and divides one number after another by a step while that improves the
// mean PSNR; repeats twice with the square root of the step. Writes tuned.json to the output folder and adds the
// numbers to the report.
void tune(const Options& options, const demosaic::Dataset& dataset, apps::Report& report);

}  // namespace deconvolution
