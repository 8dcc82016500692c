// jpeg_file.h -- .jpg and .jpeg: grey or RGB, 8 bits. Only built with libjpeg.
#pragma once

#include <string>

#include "run_gen/elements.h"

namespace retrograde::run_gen {

// Throws Problem if the file cannot be read or is not a JPEG.
Image read_jpeg(const std::string& path);
// Writes 1 or 3 channels of 8 bits; the samples are interleaved (channels innermost).
void write_jpeg(const std::string& path, int width, int height, int channels,
                const std::string& samples);

}  // namespace retrograde::run_gen
