// quality.h -- compares a picture with the truth.
#pragma once

#include <span>

#include "burst.h"

namespace burst {

// 10 log10(1 / mean squared error) over all colours of the pixels that every frame sees, clamped to [0, 1], in sRGB's
// encoding. planes: [3, height, width].
double psnr_db(std::span<const float> planes, const Truth& truth, const FrameSize& size);

}  // namespace burst
