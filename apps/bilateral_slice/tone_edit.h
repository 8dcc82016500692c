// tone_edit.h -- the edit that the demo learns: local tone mapping.
//
// The photo's log luminance is split by a guided filter (He, Sun, Tang: "Guided image filtering",
// 2013, with the image as its own guide) into a smooth base that keeps strong edges, and detail.
// The base is compressed towards a bright key, the detail is amplified, and colours follow the new
// luminance with more saturation in what was dark. What happens to a pixel depends on its
// surroundings: no curve of colours alone does the same.
#pragma once

#include "shape.h"

namespace bilateral_slice {

// photo: [coefficients, height, width] -> edited: [channels, height, width], values in [0, 1].
void tone_edit(const Shape& shape, float* photo, float* edited);

}  // namespace bilateral_slice
