// Which conditions of a gather are true but for borders, and where they come to stand.
#pragma once

#include <vector>

#include "autodiff/inversion/access_inversion.h"
#include "graph/function.h"

namespace retrograde::autodiff {

// Conditions on ranges are true but for borders; those on residues are not.
bool is_range_condition(const Expr& e);
// The conditions of a gather that fail in a border only: those on ranges, in which reduction
// variables move no further than a stencil does. Loops are cut there. What a wider reduction
// variable decides becomes the ends of its own loop (trim_loops).
bool fails_in_a_border(const Expr& condition, const std::vector<ReductionVariable>& rvars);
// Whether a gather sums a few terms, which its condition leaves out in borders alone.
bool has_borders(const Gather& g);

// The predicate of an update: those of its parts that fail in a border are likely.
Expr with_likely_parts(const Expr& predicate, const std::vector<ReductionVariable>& rvars);
// The value, or zero where the predicate is false; an undefined one holds everywhere.
Expr masked(const Expr& predicate, const Expr& value);

}  // namespace retrograde::autodiff
