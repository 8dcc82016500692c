// stability_check.h -- --check-stability: varies viscosity, diffusion and time step over six decades.
#pragma once

#include <functional>
#include <vector>

#include "common/checks.h"
#include "scene.h"

namespace fluid {

// For each value: compares loss, last density and gradient in float32 with double, and finds when Adam diverges with
// steps of about a factor of two. Without safeguards, viscosity, diffusion and time step themselves are optimized, may
// become negative, and no step is refused. With safeguards, their logarithms are optimized, and steps that are not
// finite are undone.
std::vector<apps::StabilityRow> check_stability(
    const Scene& scene, uint64_t seed,
    const std::function<void(int done, int total, const std::string& name)>& shown);

}  // namespace fluid
