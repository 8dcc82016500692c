// pictures.h -- writes pictures for viewing: planes as files, the mosaic in its colours, an enlarged part of several.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "burst.h"

namespace burst {

// planes: [3, height, width]. The picture is turned according to the orientation (apps::upright). Throws
// retrograde::UserError.
void write_planes(const std::filesystem::path& path, std::span<const float> planes,
                  const FrameSize& size, int bits, int orientation);

// A mosaic with each sample in its colour: [3, height, width].
std::vector<float> coloured(std::span<const float> mosaic, const FrameSize& size);

// The most detailed part of a picture: the top left corner of the square whose neighbours' differences are largest.
struct Corner {
  int x, y;
};
Corner busiest_square(std::span<const float> planes, const FrameSize& size, int side);

// Writes the same square of each picture side by side, turned upright and enlarged by `times` without interpolation.
// Throws retrograde::UserError.
void write_enlarged(const std::filesystem::path& path,
                    std::span<const std::span<const float>> pictures, const FrameSize& size,
                    const Corner& corner, int side, int times, int orientation);

}  // namespace burst
