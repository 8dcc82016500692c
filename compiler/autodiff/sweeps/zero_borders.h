// A term that is zero beyond a border needs no condition there.
//
//   a(x) = select(0 <= x < n, seed(x), 0)
//   f_adj(x) += a(clamp(x - r, 0, n - 1)) * w(r)  where 0 <= x - r < n    =>   f_adj(x) += a(x - r) * w(r)
//
// The adjoint of what a user sees is such a Func, and that of a stage which runs over a box. A stencil's
// gathers then are a stencil over a Func with zeros around it, as a user would write the step back:
// loops are not cut for its borders, and rows of it may be copied with their zeros for the tiles of a sum
// (autoschedule/row_copies.h). Products are strong ones (graph: strong_mul), so that a zero stays one
// beside infinity.
#pragma once

#include <vector>

#include "autodiff/sweeps/accumulation.h"

namespace retrograde::autodiff {

// In place. Of conditions that fail in a border, a thin one of what the target is known to have: loops end
// where others say.
void leave_zeros_to_adjoints(std::vector<Contribution>& contributions, const AdjointTarget& target);

}  // namespace retrograde::autodiff
