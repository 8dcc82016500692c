// join_borders.h -- merges a border update into the interior term that it continues.
//
//   f_adj(x) = select(x < n - 1, a(min(x + 1, n - 1)), 0)
//   f_adj(n - 1) += a(n - 1)                               =>   f_adj(x) = a(min(x + 1, n - 1))
//
// Inverting clamped reads of neighbours gives a gather for the interior and an update for each end. The end's term
// equals the interior's term one element further, so merged they are a stencil with a clamped index again.
#pragma once

#include <vector>

#include "autodiff/sums/accumulation.h"

namespace retrograde::autodiff {

// Modifies `contributions` in place: fewer contributions with the same sum.
void join_borders(std::vector<Contribution>& contributions, const AdjointTarget& target);

}  // namespace retrograde::autodiff
