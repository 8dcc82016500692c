// gather_places.h -- rewrites the left-hand side of a gather so that bounds inference can follow it.
//
//   image_adj(0, y) += a(y)   =>   image_adj(x, y) += select(x == 0, a(y), 0), if x has few values
//   image_adj(p) += a(r)      =>   image_adj(clamp(p, low, high)) += a(r), with the bounds of the region read
#pragma once

#include "autodiff/sums/accumulation.h"

namespace retrograde::autodiff {

// A dimension has few elements if it has at most this many.
inline constexpr int64_t few_places = 8;

Gather with_safe_places(const Gather& gather, const AdjointTarget& target);

}  // namespace retrograde::autodiff
