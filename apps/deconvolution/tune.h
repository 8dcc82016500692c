// tune.h -- the original method with better numbers: a scan over the training photographs, no gradient.
#pragma once

#include "common/report.h"
#include "options.h"
#include "simulation.h"

namespace deconvolution {

// From the published numbers on: one of them after the other is multiplied and divided by a step, as long as that
// is better on the mean of decibels; then by the root of the step, twice. Writes tuned.json into the output folder,
// and enters the numbers.
void tune(const Options& options, const demosaic::Dataset& dataset, apps::Report& report);

}  // namespace deconvolution
