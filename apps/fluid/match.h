// match.h -- how far a density is from the one that is wanted.
//
//   e(x, y) = density - target
//   loss    = mean of  e (e + near e) / 2,    near = (1 + (reach cells)^2 L)^-1
//
// The mean squared difference alone says nothing of smoke that lies beside its place: nothing
// overlaps. The second term sees differences as if they were spread over `reach` (in sides of the
// box), so that its gradient tells smoke where to go from afar; a close relation of it is the
// distance of optimal transport for small moves (R. Peyre, Comparison between W2 distance and H^-1
// norm, and localization of Wasserstein distance, ESAIM: COCV 24(4), 2018).
#pragma once

#include <retrograde/retrograde.h>

#include "frame_shape.h"

namespace fluid {

class Match {
 public:
  Match(const FrameShape& shape, retrograde::Type scalar, double reach);

  retrograde::ImageParam density, target;
  retrograde::Func loss{"loss"};              // of no variables
  retrograde::Func difference{"difference"};  // the mean of e^2 alone
  retrograde::Func gradient;                  // of the loss by the density
};

}  // namespace fluid
