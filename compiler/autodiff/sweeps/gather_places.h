// Where one gather adds: places that the bounds of its update can follow.
//
//   image_adj(0, y) += a(y)   =>   image_adj(x, y) += select(x == 0, a(y), 0), when few x exist
//   image_adj(p) += a(r)      =>   image_adj(clamp(p, low, high)) += a(r), of the region read
#pragma once

#include "autodiff/sweeps/accumulation.h"

namespace retrograde::autodiff {

Gather with_safe_places(const Gather& gather, const AdjointTarget& target);

}  // namespace retrograde::autodiff
