// jpeg_file.h -- .jpg and .jpeg: grey or RGB, 8 bits. Only where libjpeg is.
#pragma once

#include <string>

#include "run_gen/elements.h"

namespace retrograde::run_gen {

// Problem when the file cannot be read, or is no JPEG.
Image read_jpeg(const std::string& path);
// Of 1 or 3 channels of 8 bits, their samples as the file wants them: channels innermost.
void write_jpeg(const std::string& path, int width, int height, int channels,
                const std::string& samples);

}  // namespace retrograde::run_gen
