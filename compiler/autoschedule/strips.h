// strips.h -- pure Funcs, and sums over a few iterations, that read each other row by row run through
// strips of the last of them, a pure one, together.
//
//   across(x, y) = in(x - 1, y) + in(x + 1, y);  both(x, y) = across(x, y - 1) + across(x, y + 1)
//
//   for y, x: across = ...          parallel for strips of y:
//   for y, x: both = ...       =>     for y in the strip:
//                                       for x: across = ... of the rows that are not there yet
//                                       for x: both = ...
//
// Of `across` each thread keeps a window of rows in its cache, where there was an image in memory;
// at the border of strips rows are computed twice. A sum is one row at a time there, so its tile in
// registers is of one row.
#pragma once

#include <functional>
#include <unordered_set>
#include <vector>

#include "autoschedule/size_estimate.h"
#include "graph/function.h"

namespace retrograde::autoschedule {

// Gives a sum other loops: of these dimensions an element is computed at a time.
using GiveLoopsOfRows =
    std::function<void(const FuncPtr& sum, const std::vector<size_t>& dimensions)>;

// Moves those of `given`, which this scheduler has computed at root and given loops, into the strips
// of the only group of such Funcs that reads them, where that is less work than a way to memory.
// `but`: none of these, as the last of a group neither.
void compute_in_strips(const std::vector<FuncPtr>& outputs, const std::vector<FuncPtr>& given,
                       const std::unordered_set<const Symbol*>& but, const SizeEstimate& sizes,
                       const GiveLoopsOfRows& give_rows);

}  // namespace retrograde::autoschedule
