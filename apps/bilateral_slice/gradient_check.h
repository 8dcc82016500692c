// gradient_check.h -- checks the model's adjoints against central differences, both in double.
#pragma once

#include <retrograde/retrograde.h>

#include "groups.h"
#include "shape.h"

namespace bilateral_slice {

struct GradientCheck {
  double max_relative_error = 0;
  int compared = 0;  // number of derivatives: along random directions, and by single parameters
};

// Which groups to check, on how many pixels along each side (0: 96 x 80).
struct CheckOptions {
  Groups moves;
  int side = 0;
};

// Checks a crop from the middle of the pair (layout as for Trainer), with a grid of 8 x 8 x 8 and parameters away from
// the identity. Errors are relative to the larger of the two values.
GradientCheck check_gradient(const Shape& shape, const float* photo, const float* target,
                             const CheckOptions& options);

// The library's own gradient check on the same crop and parameters, with the model in float32.
retrograde::GradientReport check_gradients_in_full(const Shape& shape, const float* photo,
                                                   const float* target,
                                                   const CheckOptions& options);

}  // namespace bilateral_slice
