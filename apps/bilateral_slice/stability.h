// stability.h -- --check-stability: photographs that leave most of the grid empty, and other extreme inputs.
#pragma once

#include <vector>

#include "common/checks.h"

namespace bilateral_slice {

// The loss and its gradient by grid, mix and curve, in float32 against double; and Adam on all three with a large rate.
std::vector<apps::StabilityRow> check_stability();

}  // namespace bilateral_slice
