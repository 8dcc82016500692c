// look.h -- a look that was learned, apart from any photo: kept in a file, and given to others.
#pragma once

#include <filesystem>
#include <vector>

#include "shape.h"

namespace bilateral_slice {

class Trainer;

struct Look {
  int grid_x = 0, grid_y = 0, grid_z = 0, knots = 0;
  std::vector<float> grid, mix, curve;  // as Model has them

  // The grid spread over a photo of this size.
  Shape shape(int width, int height) const;
};

Look look_of(const Shape& shape, const Trainer& trainer);

// The photo, [4, height, width], through the look: [3, height, width].
std::vector<float> through_look(const Look& look, const Shape& photo_shape,
                                std::vector<float>& photo);

// A file of common/state.h. Throws retrograde::UserError when it cannot be written, or is no look.
void write_look(const std::filesystem::path& path, const Look& look);
Look read_look(const std::filesystem::path& path);

}  // namespace bilateral_slice
