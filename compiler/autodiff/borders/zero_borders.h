// zero_borders.h -- drops border conditions on terms that are zero beyond the border anyway.
//
//   a(x) = select(0 <= x < n, seed(x), 0)
//   f_adj(x) += a(clamp(x - r, 0, n - 1)) * w(r)  where 0 <= x - r < n    =>   f_adj(x) += a(x - r) * w(r)
//
// The adjoint of an output is such a Func, and so is that of a stage which runs over a box. The gathers of a stencil
// then form a stencil over a Func with zero padding, as a user would write the adjoint by hand. Loops are not split at
// its borders, and rows may be packed with their zeros for register tiling. Products are
// strong (graph: strong_mul), so a zero stays zero beside infinity.
//
// Other factors may have the clamped place in remainders and conditions, as those of a transposed convolution do:
//
//   a(clamp(4 * x + r, 0, n - 1)) * w(clamp(4 * x + r, 0, n - 1) % 4)   =>   a(4 * x + r) * w(r)      r < 4
//
// Beyond the border the term is zero with any factor, and a remainder stays in its range.
#pragma once

#include <vector>

#include "autodiff/sums/accumulation.h"

namespace retrograde::autodiff {

// Modifies `contributions` in place. Drops only conditions of a border that is thin compared with the target's known
// size; a condition that bounds a loop stays.
void leave_zeros_to_adjoints(std::vector<Contribution>& contributions, const AdjointTarget& target);

}  // namespace retrograde::autodiff
