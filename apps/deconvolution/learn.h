// learn.h -- the learning run: steps of Adam until they are done, the seconds are over or somebody stops it.
#pragma once

#include "common/report.h"
#include "demosaic/photographs.h"
#include "measure.h"
#include "options.h"
#include "weights.h"

namespace deconvolution {

struct Learned {
  Weights weights;
  Measured held_out;  // at the last look; no photographs when it was stopped before
  long steps = 0;
  bool stopped = false;
};

// Writes state.bin and weights.json into the output folder, also when it is stopped, and enters its
// curves. --resume goes on from state.bin. Throws retrograde::Error.
Learned learn(const Options& options, const demosaic::Dataset& dataset, const Gallery& held_out,
              apps::Report& report);

}  // namespace deconvolution
