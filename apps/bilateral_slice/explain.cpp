// explain.cpp -- see explain.h.
#include "explain.h"

#include <cstdio>

#include "diagnostics/error.h"
#include "training_pipeline.h"

namespace bilateral_slice {

using retrograde::text;

std::vector<std::string> left_out(const Shape& shape, const Groups& moves) {
  std::vector<std::string> out;
  if (!moves.grid)
    out.push_back("the adjoints of planes, transforms and grid, and its step: it does not move");
  if (!moves.guide())
    out.push_back("the adjoints of depth and guide, and all behind: neither mix nor curve moves");
  else if (!moves.mix)
    out.push_back("the adjoints of light and mix, and its step: it does not move");
  else if (!moves.curve)
    out.push_back("the adjoint of the curve, and its step: it does not move");
  if (shape.channels == 1)
    out.push_back(
        "two of three channels: the photo is gray, a transform has 2 coefficients and not 12");
  return out;
}

void explain(const Shape& shape, const Groups& moves) {
  const lang::Derivative adjoints = TrainingPipeline(shape, moves).adjoints;
  std::printf("a grid of %d x %d x %d nodes of %d coefficients over %d x %d pixels of %d %s\n%s\n",
              shape.grid_x, shape.grid_y, shape.grid_z, shape.channels * shape.coefficients(),
              shape.width, shape.height, shape.channels,
              shape.channels == 1 ? "channel" : "channels", adjoints.explain().c_str());
  for (const std::string& line : left_out(shape, moves))
    std::printf("left out: %s\n", line.c_str());
}

}  // namespace bilateral_slice
