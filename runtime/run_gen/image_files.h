// image_files.h -- reads and writes buffers as files. .npy and .tmp keep every type. .pgm, .ppm, .png and .jpg hold 8
// or 16 bits; as floats they are fractions of 1.
#pragma once

#include <string>

#include "run_gen/elements.h"

namespace retrograde::run_gen {

// Returns elements of this type in this number of dimensions. Throws Problem if the file cannot provide that.
Image read_image(const std::string& path, halide_type_t type, int dimensions);
void write_image(const std::string& path, const Image& image);

}  // namespace retrograde::run_gen
