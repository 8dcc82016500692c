// pictures.h -- pictures for people: planes as files, the mosaic in its colours, an enlarged part of several.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "burst.h"

namespace burst {

// planes: [3, height, width]. The picture is turned as the orientation says (apps::upright). Throws
// retrograde::UserError.
void write_planes(const std::filesystem::path& path, std::span<const float> planes,
                  const FrameSize& size, int bits, int orientation);

// A mosaic, each sample in its colour: [3, height, width].
std::vector<float> coloured(std::span<const float> mosaic, const FrameSize& size);

// Where there is most to see: the top left corner of the square of so many pixels whose differences of
// neighbours are largest.
struct Corner {
  int x, y;
};
Corner busiest_square(std::span<const float> planes, const FrameSize& size, int side);

// The same square of each, turned, enlarged so many times without interpolation, side by side. Throws
// retrograde::UserError.
void write_enlarged(const std::filesystem::path& path,
                    std::span<const std::span<const float>> pictures, const FrameSize& size,
                    const Corner& corner, int side, int times, int orientation);

}  // namespace burst
