// checks.h -- --check-gradients and --check-stability of lens.
#pragma once

#include <vector>

#include "common/checks.h"
#include "scene.h"

namespace lens {

// By each group that the lens has, with all features that the scene has, beside a kink of the hinges.
std::vector<apps::GradientRow> check_gradients(const Lens& lens, const SceneOptions& options);

// Lenses at the ends of what can be traced: grazing incidence, rays that miss, total reflection, nearly
// concentric surfaces, no power at all ...; float32 against double, and Adam with a large rate.
std::vector<apps::StabilityRow> check_stability(const Scene& scene);

}  // namespace lens
