// gradient_check.h -- --check-gradients: the adjoint through several frames against differences.
#pragma once

#include <vector>

#include "common/checks.h"
#include "scene.h"

namespace fluid {

// A small scene of the same kind: at most 20 cells along a side, 5 frames, 5 nodes of the force, the
// same stages, and something moving in it.
Scene small_scene(const Scene& scene);

// A point to check at: a random force, the other variables a little off their starts.
std::vector<double> random_point(const Variables& variables, uint64_t seed);

// For each group of variables that is optimized: the adjoint in double along random directions and
// along the gradient against central differences in double; all of it in float32 against double.
std::vector<apps::GradientRow> check_gradients(const Scene& scene, uint64_t seed);

}  // namespace fluid
