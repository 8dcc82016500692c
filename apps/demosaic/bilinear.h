// bilinear.h -- bilinear demosaicking: each missing sample is the mean of the two or four nearest of its colour.
#pragma once

#include <retrograde/retrograde.h>

namespace demosaic {

namespace lang = retrograde;

// Returns [3, height, width] for a mosaic R G over G B that can be read one sample beyond the image.
lang::Func bilinear(const lang::Func& mosaic);

}  // namespace demosaic
