// learn.h -- the learning run: steps of Adam until they are done, the seconds are over or somebody stops it.
#pragma once

#include "common/report.h"
#include "measure.h"
#include "options.h"
#include "photographs.h"
#include "weights.h"

namespace demosaic {

struct Learned {
  Weights weights;
  long steps = 0;
  bool stopped = false;
};

// Writes state.bin and weights.json into the output folder, also when it is stopped, and enters its
// curves. --resume goes on from state.bin. Throws retrograde::Error.
Learned learn(const Options& options, const Dataset& dataset, Gallery& held_out,
              apps::Report& report);

// How long a step takes when all groups are learned, or one of them alone.
apps::Table time_steps(const Options& options, const Dataset& dataset);

}  // namespace demosaic
