// step_times.h -- --time-steps: the time of a step, by moving groups and by channels.
#pragma once

#include "common/report.h"
#include "pairs.h"

namespace bilateral_slice {

// The pair must be in colour; gray rows use its luminance.
apps::Table time_steps(const Pair& pair, int threads);

}  // namespace bilateral_slice
