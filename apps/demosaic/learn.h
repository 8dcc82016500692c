// learn.h -- the learning run: Adam steps until they are done, the time limit is reached or the user stops it.
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

// Writes state.bin and weights.json to the output folder, also if it is stopped, and adds its curves to the report.
// --resume continues from state.bin. Throws retrograde::Error.
Learned learn(const Options& options, const Dataset& dataset, Gallery& held_out,
              apps::Report& report);

// The time of a step when all groups are learned, and when only one is.
apps::Table time_steps(const Options& options, const Dataset& dataset);

}  // namespace demosaic
