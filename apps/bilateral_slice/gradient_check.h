// gradient_check.h -- the model's adjoints against central differences, both in double.
#pragma once

#include <retrograde/retrograde.h>

#include "groups.h"
#include "shape.h"

namespace bilateral_slice {

struct GradientCheck {
  double max_relative_error = 0;
  int compared = 0;  // derivatives: along random directions, and of single parameters
};

// What is checked: the gradient by which groups, on how many pixels along each side (0: 96 x 80).
struct CheckOptions {
  Groups moves;
  int side = 0;
};

// On a crop from the middle of the pair (layout as for Trainer), with a grid of 8 x 8 x 8 and
// parameters away from the identity. An error is relative to the larger of the two values.
GradientCheck check_gradient(const Shape& shape, const float* photo, const float* target,
                             const CheckOptions& options);

// The library's own check of the same crop and parameters, with the model in float32.
retrograde::GradientReport check_gradients_in_full(const Shape& shape, const float* photo,
                                                   const float* target,
                                                   const CheckOptions& options);

}  // namespace bilateral_slice
