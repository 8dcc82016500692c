// gradient_check.h -- --check-gradients: checks the adjoint through several frames against differences.
#pragma once

#include <vector>

#include "common/checks.h"
#include "scene.h"

namespace fluid {

// A small scene of the same kind: at most 20 cells along a side, 5 frames, 5 nodes of the force, the same stages, and
// some initial motion.
Scene small_scene(const Scene& scene);

// The point to check: a random force, with the other variables near their initial values.
std::vector<double> random_point(const Variables& variables, uint64_t seed);

// For each optimized group of variables: the adjoint in double, along random directions and along the gradient, against
// central differences in double; and the adjoint in float32 against double.
std::vector<apps::GradientRow> check_gradients(const Scene& scene, uint64_t seed);

}  // namespace fluid
