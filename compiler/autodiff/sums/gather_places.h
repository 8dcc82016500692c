// gather_places.h -- rewrites the left-hand side of a gather so that bounds inference can follow it.
//
//   image_adj(0, y) += a(y)   =>   image_adj(x, y) += select(x == 0, a(y), 0), if x has few values
//   image_adj(p) += a(r)      =>   image_adj(clamp(p, low, high)) += a(r), with the bounds of the region read
#pragma once

#include "autodiff/sums/accumulation.h"

namespace retrograde::autodiff {

Gather with_safe_places(const Gather& gather, const AdjointTarget& target);

}  // namespace retrograde::autodiff
