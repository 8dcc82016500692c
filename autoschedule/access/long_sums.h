// long_sums.h -- float sums whose chains of additions would be too long.
//
//   total(y) += exp(f(r, y))     a long sum for more than 512 terms. Vectors of terms are 16 chains, which are short
//                                enough for 8192 of them
//
// A chain of n additions in float32 is wrong by up to n * 2^-24 of the sum of absolute values. Sums of adjoints are split
// where they are made.
#pragma once

#include "autoschedule/access/sizes.h"

namespace retrograde::planning {

// Whether the update adds more terms to an element, in a type that is rounded to less than double, than one chain should.
bool is_long_sum(StageId stage, const SizeModel& sizes);
// Whether vectors of terms load neighbours, and make chains short enough.
bool is_short_in_lanes(StageId stage, const SizeModel& sizes);
// The terms that an element of an update takes.
double terms_of(StageId stage, const SizeModel& sizes);
// The iterators of an update's reduction, innermost first.
std::vector<int> reduction_of(const StageNode& stage);
// Whether all of the reduction is for the same elements: neither a scan nor a scatter.
bool adds_in_place(const StageNode& stage);

}  // namespace retrograde::planning
