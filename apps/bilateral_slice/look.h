// look.h -- a look that was learned, apart from any photo: kept in a file, and given to others.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "shape.h"

namespace bilateral_slice {

class Trainer;

struct Look {
  int grid_x = 0, grid_y = 0, grid_z = 0, knots = 0, channels = 3;
  std::vector<float> grid, mix, curve;  // as Model has them

  // The grid spread over a photo of this size.
  Shape shape(int width, int height) const;
};

Look look_of(const Shape& shape, const Trainer& trainer);
// What the trainer goes on from. Its shape must be that of the look.
void start_from(const Look& look, Trainer& trainer);

// The photo, [coefficients, height, width], through the look: [channels, height, width]. Both have the same
// channels.
std::vector<float> through_look(const Look& look, const Shape& photo_shape,
                                std::vector<float>& photo);

// Throws retrograde::UserError for a photo with colours and a look for gray ones. The other way round, the
// photo is taken in three equal channels.
void require_fits(const Look& look, const std::string& look_name, int photo_channels,
                  const std::string& photo_name);

// A file of common/state.h. Throws retrograde::UserError when it cannot be written, or is no look.
void write_look(const std::filesystem::path& path, const Look& look);
Look read_look(const std::filesystem::path& path);

}  // namespace bilateral_slice
