// Conditions on one reduction variable become the ends of its range.
//
//   rho in [0, n) where rho < m && p     =>     rho in [0, min(n, m)) where p
//
// A border of run-time size is such a gather: the elements beyond a clamp's end. Loops that are
// trimmed later (lower/trim_loops) say the same, but not those that are split into lanes and parts
// first, as the sums of few elements are: they ran over all of the domain.
#pragma once

#include "autodiff/inversion/access_inversion.h"

namespace retrograde::autodiff {

// In place: the gather's reduction domain must be its own. Constant extents stay: their loops are
// unrolled, with their conditions.
void narrow_reductions(Gather& g, const std::vector<std::string>& target_args);

}  // namespace retrograde::autodiff
