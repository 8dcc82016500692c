// image_files.h -- buffers in files: .npy and .tmp keep every type; .pgm, .ppm, .png and
// .jpg hold 8 or 16 bits, which are fractions of 1 where floats are wanted.
#pragma once

#include <string>

#include "run_gen/elements.h"

namespace retrograde::run_gen {

// With elements of this type and this many dimensions. Problem when the file cannot be that.
Image read_image(const std::string& path, halide_type_t type, int dimensions);
void write_image(const std::string& path, const Image& image);

}  // namespace retrograde::run_gen
