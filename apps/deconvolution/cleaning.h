// cleaning.h -- removes noise and ringing from an image but keeps its edges, by a bilateral grid as a pipeline.
//
//   grid(X, Y, z)   the pixels of a square of 20 x 20 whose brightness is near bin z, and their number: each pixel
//                   is divided between the two nearest bins
//   blurred         twice along each axis by [a, 1 - 2 a, a], with a learned for space and for brightness
//   sliced          read at a pixel's position and brightness, linearly; sum divided by count
//   cleaned         image + mix (sliced - image)
//
// With a = 1/4 and mix = 1 it smooths over 20 pixels and bins of 0.033, the numbers of Fortunato and Oliveira (The
// Visual Computer 30, 2014, section 3.2), who use another filter, the domain transform. The grid: J. Chen, S. Paris, F.
// Durand, Real-time edge-aware image processing with the bilateral grid, ACM Transactions on Graphics 26 (3), 2007,
// section 3.
#pragma once

#include <retrograde/retrograde.h>

namespace deconvolution {

// The learned numbers of the smoothing: mix; a in space; a along brightness.
inline constexpr int smoothing_numbers = 3;
inline constexpr double usual_blur = 0.25;

// `image` and the result are [n, height, width].
retrograde::Func clean(const retrograde::Func& image, const retrograde::ImageParam& smoothing,
                       int width, int height, retrograde::Type scalar);

}  // namespace deconvolution
