// match.h -- the distance between a density and its target.
//
//   e(x, y) = density - target
//   loss    = mean of  e (e + near e) / 2,    near = (1 + (reach cells)^2 L)^-1
//
// The mean squared difference alone gives no useful gradient for smoke that does not overlap its target. The second
// term compares as if differences were spread over `reach` (in sides of the box), so its gradient tells smoke from a
// distance where to go. It is closely related to the optimal transport distance for small displacements (R. Peyre,
// Comparison between W2 distance and H^-1 norm, and localization of Wasserstein distance, ESAIM: COCV 24(4), 2018).
#pragma once

#include <retrograde/retrograde.h>

#include "frame_shape.h"

namespace fluid {

class Match {
 public:
  Match(const FrameShape& shape, retrograde::Type scalar, double reach);

  retrograde::ImageParam density, target;
  retrograde::Func loss{"loss"};              // without dimensions
  retrograde::Func difference{"difference"};  // only the mean of e^2
  retrograde::Func gradient;                  // of the loss by the density
};

}  // namespace fluid
