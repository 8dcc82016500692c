// tone_edit.h -- the edit that the demo learns: local tone mapping.
//
// A guided filter splits the photo's log luminance (He, Sun, Tang: "Guided image filtering", 2013, with the image as
// its own guide) into detail and a smooth base that keeps strong edges. The base is compressed towards a bright key and
// the detail is amplified. Colours follow the new luminance, with more saturation in formerly dark areas. The result of
// a pixel depends on its surroundings, so no colour curve alone can do the same.
#pragma once

#include "shape.h"

namespace bilateral_slice {

// photo: [coefficients, height, width] -> edited: [channels, height, width], values in [0, 1].
void tone_edit(const Shape& shape, float* photo, float* edited);

}  // namespace bilateral_slice
