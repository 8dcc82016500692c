// reference.h -- a reference for tests: the objective and its gradient in plain C++ and double, pixel by pixel, with
// derivatives derived by hand.
#pragma once

#include <span>
#include <vector>

#include "objective.h"

namespace burst::reference {

struct Value {
  double loss = 0;
  std::vector<double> sampled;   // [frames, height, width]; 0 for pixels beyond the picture
  std::vector<double> gradient;  // by x, including all homographies
};

// x: the picture [3, height, width], then the homographies [frames, 8]. samples: [frames, height, width].
Value objective(const Shape& shape, const Smoothness& smoothness, std::span<const double> x,
                std::span<const float> samples);

}  // namespace burst::reference
