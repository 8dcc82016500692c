// checks.h -- --check-gradients and --check-stability of lens.
#pragma once

#include <vector>

#include "common/checks.h"
#include "scene.h"

namespace lens {

// Checks the gradient by each group that the lens has, with all features of the scene, away from the hinges' kinks.
std::vector<apps::GradientRow> check_gradients(const Lens& lens, const SceneOptions& options);

// Lenses that can barely be traced: grazing incidence, rays that miss, total reflection, nearly concentric surfaces, no
// optical power, and others. Compares float32 with double, and runs Adam with a large rate.
std::vector<apps::StabilityRow> check_stability(const Scene& scene);

}  // namespace lens
