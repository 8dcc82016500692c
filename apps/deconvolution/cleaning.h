// cleaning.h -- an image without its noise and ringing but with its edges: a bilateral grid, as pipeline.
//
//   grid(X, Y, z)   the pixels of a square of 20 x 20 whose brightness is near bin z, and how many: each pixel is
//                   shared between the two bins nearest to it
//   blurred twice along each axis by [a, 1 - 2 a, a], a learned for space and for brightness
//   sliced          read back at a pixel's place and brightness, linearly; sum over count
//   cleaned         image + mix (sliced - image)
//
// With a = 1/4 and mix = 1 it smooths over 20 pixels and bins of 0.033, the numbers of Fortunato and Oliveira
// (The Visual Computer 30, 2014, section 3.2), whose filter is another one, the domain transform. The grid:
// J. Chen, S. Paris, F. Durand, Real-time edge-aware image processing with the bilateral grid, ACM Transactions
// on Graphics 26 (3), 2007, section 3.
#pragma once

#include <retrograde/retrograde.h>

namespace deconvolution {

// The numbers of an image's smoothing: mix; a in space; a along brightness.
inline constexpr int smoothing_numbers = 3;
inline constexpr double usual_blur = 0.25;

// `image` and the result are [n, height, width].
retrograde::Func clean(const retrograde::Func& image, const retrograde::ImageParam& smoothing,
                       int width, int height, retrograde::Type scalar);

}  // namespace deconvolution
