// A border joins the interior whose term goes on there.
//
//   f_adj(x) = select(x < n - 1, a(min(x + 1, n - 1)), 0)
//   f_adj(n - 1) += a(n - 1)                               =>   f_adj(x) = a(min(x + 1, n - 1))
//
// Clamped reads of neighbours are gathers from the inside and updates of the ends. The element
// before the first and the one behind the last are read by the neighbour on the other side: as terms
// these are the same, so that the step back is a stencil over a clamped place again.
#pragma once

#include <vector>

#include "autodiff/sweeps/accumulation.h"

namespace retrograde::autodiff {

// In place: fewer contributions that add the same.
void join_borders(std::vector<Contribution>& contributions, const AdjointTarget& target);

}  // namespace retrograde::autodiff
