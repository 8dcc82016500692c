// split_at_select.h -- splits an access at a select, one branch of which isl cannot represent.
#pragma once

#include <vector>

#include "autodiff/inversion/access_inversion.h"

namespace retrograde::autodiff {

// Splits a query at select(inside, x, other). Each branch becomes a query of its own, so that a boundary condition of
// parametric size does not turn the interior into a scatter. The domains of the parts are disjoint, and their loops
// have the bounds that the conditions imply. Empty if there is nothing to split.
std::vector<AccessQuery> split_at_select(const AccessQuery& query);

}  // namespace retrograde::autodiff
