// reference.h -- slow references for tests: the methods in plain C++ and double, pixel by pixel, as in their equations.
#pragma once

#include <vector>

#include "weights.h"

namespace demosaic::reference {

// A mosaic R G over G B, [height, width]; results are planes [3, height, width].
struct Mosaic {
  int width, height;
  std::vector<float> samples;
};

std::vector<double> bilinear(const Mosaic& mosaic);
std::vector<double> ahd(const Mosaic& mosaic);
std::vector<double> relaxed(const Mosaic& mosaic, Weights weights);

}  // namespace demosaic::reference
