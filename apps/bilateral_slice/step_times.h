// step_times.h -- --time-steps: how long a step takes, by what moves and by channels.
#pragma once

#include "common/report.h"
#include "pairs.h"

namespace bilateral_slice {

// On this pair, which must be in colour for the rows of all channels; gray rows are of its luminance.
apps::Table time_steps(const Pair& pair, int threads);

}  // namespace bilateral_slice
