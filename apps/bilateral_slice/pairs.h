// pairs.h -- photographs as planes, and what they shall look like.
#pragma once

#include <filesystem>
#include <vector>

#include "common/images.h"
#include "shape.h"

namespace bilateral_slice {

using Planes = std::vector<float>;

// The photo, and what it shall look like. Layouts as for Trainer.
struct Pair {
  Shape shape;
  int bits = 8;
  Planes photo, target;
};

// As it is stored: three channels, or one where there are no colours; alpha is left out. Throws
// retrograde::UserError.
apps::Image read_gray_or_colour(const std::filesystem::path& path);

// A plane for each channel, and one of ones when `homogeneous`. A gray image has as many as are asked for.
Planes to_planes(const apps::Image& image, int channels, bool homogeneous);
apps::Image to_image(const Shape& shape, const Planes& planes, int bits);

// Gray where neither image has colours. Without a target: the built-in edit. Throws retrograde::UserError
// when an image cannot be read, is too small, or the sizes differ.
Pair read_pair(const std::filesystem::path& photo, const std::filesystem::path& target);

// A gray pair in three equal channels, which those of a colour photo go with.
void make_colour(Pair& pair);

// Both at another size.
Pair resized(const Pair& pair, int width, int height);

double mean_squared_difference(const Planes& a, const Planes& b, long samples);

}  // namespace bilateral_slice
