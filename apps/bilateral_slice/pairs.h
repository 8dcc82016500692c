// pairs.h -- photographs as planes, with their target images.
#pragma once

#include <filesystem>
#include <vector>

#include "common/images.h"
#include "shape.h"

namespace bilateral_slice {

using Planes = std::vector<float>;

// The photo and its target. Layouts as for Trainer.
struct Pair {
  Shape shape;
  int bits = 8;
  Planes photo, target;
};

// The image as it is stored: three channels, or one if it has no colours; alpha is left out. Throws
// retrograde::UserError.
apps::Image read_gray_or_colour(const std::filesystem::path& path);

// One plane per channel, and one of ones if `homogeneous`. A gray image fills all the requested channels.
Planes to_planes(const apps::Image& image, int channels, bool homogeneous);
apps::Image to_image(const Shape& shape, const Planes& planes, int bits);

// Gray if neither image has colours. Without a target: the built-in edit. Throws retrograde::UserError if an image
// cannot be read, is too small, or the sizes differ.
Pair read_pair(const std::filesystem::path& photo, const std::filesystem::path& target);

// Turns a gray pair into three equal channels, to match colour photos.
void make_colour(Pair& pair);

// Both images at another size.
Pair resized(const Pair& pair, int width, int height);

double mean_squared_difference(const Planes& a, const Planes& b, long samples);

}  // namespace bilateral_slice
