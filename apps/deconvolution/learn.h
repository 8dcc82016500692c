// learn.h -- the learning run: Adam steps until they are done, the time limit is reached or the user stops it.
#pragma once

#include "common/report.h"
#include "demosaic/photographs.h"
#include "measure.h"
#include "options.h"
#include "weights.h"

namespace deconvolution {

struct Learned {
  Weights weights;
  Measured held_out;  // at the last evaluation; no photographs if it was stopped before
  long steps = 0;
  bool stopped = false;
};

// Writes state.bin and weights.json to the output folder, also if it is stopped, and adds its curves to the report.
// --resume continues from state.bin. Throws retrograde::Error.
Learned learn(const Options& options, const demosaic::Dataset& dataset, const Gallery& held_out,
              apps::Report& report);

}  // namespace deconvolution
