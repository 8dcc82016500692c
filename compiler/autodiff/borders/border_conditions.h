// border_conditions.h -- recognises the conditions of a gather that fail only near a border.
#pragma once

#include <vector>

#include "autodiff/inversion/access_inversion.h"
#include "graph/function.h"

namespace retrograde::autodiff {

// Whether `e` restricts a range. Such conditions fail only at borders; conditions on residues fail everywhere.
bool is_range_condition(const Expr& e);
// Whether the condition of a gather fails only in a border: it restricts a range, and its reduction variables move it
// no further than a stencil does. Loops are split there. A condition on a longer reduction variable becomes the bounds
// of that variable's loop instead (trim_loops).
bool fails_in_a_border(const Expr& condition, const std::vector<ReductionVariable>& rvars);
// Whether the condition restricts a variable of the region to a few of its values: it fails nearly everywhere, as that of
// elements from which a recurrence starts.
bool holds_in_a_border(const Expr& predicate, const std::vector<LoopVariable>& region);
// Whether a gather sums a few terms, and its condition drops terms only at borders.
bool has_borders(const Gather& g);

// The predicate of an update, in which the parts that fail only at a border are marked likely.
Expr with_likely_parts(const Expr& predicate, const std::vector<ReductionVariable>& rvars);
// The value, or zero where the predicate is false. An undefined predicate is true.
Expr masked(const Expr& predicate, const Expr& value);

}  // namespace retrograde::autodiff
