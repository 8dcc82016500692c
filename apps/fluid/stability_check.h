// stability_check.h -- --check-stability: viscosity, diffusion and time step over six decades.
#pragma once

#include <functional>
#include <vector>

#include "common/checks.h"
#include "scene.h"

namespace fluid {

// For each value: loss, last density and gradient in float32 against double, and when Adam with
// steps of a factor of about two diverges. Without safeguards viscosity, diffusion and time step
// themselves are changed, and may become negative, and nothing is refused; with safeguards their
// logarithms are, and steps that are not finite are taken back.
std::vector<apps::StabilityRow> check_stability(
    const Scene& scene, uint64_t seed,
    const std::function<void(int done, int total, const std::string& name)>& shown);

}  // namespace fluid
