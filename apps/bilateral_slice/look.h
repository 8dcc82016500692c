// look.h -- a learned look, independent of any photo; it can be saved to a file and applied to other photos.
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

  // The sizes of the model for a photo of this size, over which the grid is spread.
  Shape shape(int width, int height) const;
};

Look look_of(const Shape& shape, const Trainer& trainer);
// Sets the trainer's initial parameters. Its shape must be that of the look.
void start_from(const Look& look, Trainer& trainer);

// Applies the look to the photo, [coefficients, height, width]; returns [channels, height, width]. Both have the same
// channels.
std::vector<float> through_look(const Look& look, const Shape& photo_shape,
                                std::vector<float>& photo);

// Throws retrograde::UserError for a colour photo with a look for gray ones. The other way round, a gray photo is used
// as three equal channels.
void require_fits(const Look& look, const std::string& look_name, int photo_channels,
                  const std::string& photo_name);

// The file format is that of common/state.h. Throws retrograde::UserError if the file cannot be written, or is not a
// look.
void write_look(const std::filesystem::path& path, const Look& look);
Look read_look(const std::filesystem::path& path);

}  // namespace bilateral_slice
