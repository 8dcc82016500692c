// shape.h -- the sizes for which a model is compiled.
#pragma once

#include <algorithm>

namespace bilateral_slice {

// The grid's nodes are `cell_width` by `cell_height` pixels apart, the first one on pixel (0, 0). Cells are the
// smallest with which the nodes cover the photo, and at least two pixels wide and high.
struct Shape {
  int width = 0;
  int height = 0;
  int grid_x = 64;
  int grid_y = 64;
  int grid_z = 8;
  int knots = 16;    // of the guide's curve
  int channels = 3;  // of the photo and of the result; 1: gray

  int cell_width() const { return std::max((width - 1) / (grid_x - 1) + 1, 2); }
  int cell_height() const { return std::max((height - 1) / (grid_y - 1) + 1, 2); }
  long pixels() const { return static_cast<long>(width) * height; }
  long samples() const { return channels * pixels(); }
  // Coefficients of a transform for one channel: all channels and a constant.
  int coefficients() const { return channels + 1; }
  long grid_elems() const {
    return static_cast<long>(channels) * coefficients() * grid_z * grid_x * grid_y;
  }
};

}  // namespace bilateral_slice
