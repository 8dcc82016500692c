// checks.h -- --check-gradients and --check-stability of burst_superresolution, on a small part of a burst.
#pragma once

#include <vector>

#include "burst.h"
#include "common/checks.h"

namespace burst {

// Checks the gradients by the picture and by the homographies, with all features, away from kinks.
std::vector<apps::GradientRow> check_gradients(const Burst& burst, uint64_t seed);

// Cases: homographies that are nearly singular or look beyond the picture, identical frames, saturated and black
// frames. Compares float32 with double, and runs Adam with a large rate.
std::vector<apps::StabilityRow> check_stability(const Burst& burst, uint64_t seed, int threads);

}  // namespace burst
