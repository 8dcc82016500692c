// narrow_reductions.h -- turns conditions on one reduction variable of a gather into the bounds of its loop.
//
//   rho in [0, n) where rho < m && p     =>     rho in [0, min(n, m)) where p
//
// A border of run-time size is such a gather: it sums the elements beyond the end of a clamp. lower/trim_loops has the
// same effect later, but not for loops that are first split into lanes and parts, as those of sums of few elements are.
// Without this pass these loops run over the whole domain.
#pragma once

#include "autodiff/inversion/access_inversion.h"

namespace retrograde::autodiff {

// Modifies the gather in place; the gather must own its reduction domain. Constant extents stay, because such loops are
// unrolled together with their conditions.
void narrow_reductions(Gather& g, const std::vector<std::string>& target_args);

}  // namespace retrograde::autodiff
