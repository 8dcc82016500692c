// slices.h -- what one Func alone reads, slice by slice, is computed slice by slice.
//
//   distance(x, y, dx, dy) += across(x, y + r, dx, dy)
//
//   for dy, dx, y, x: across = ...          parallel for dy:
//   for dy, dx, y, x: distance += ...   =>    for dx:
//                                               for y, x: across = ...
//                                               for y, x: distance += ...
//
// No element is computed twice, in chains of these neither, and of `across` there is an image for each thread instead of one for
// each dx and dy.
#pragma once

#include <optional>
#include <string>
#include <unordered_set>
#include <vector>

#include "autoschedule/only_reader.h"
#include "autoschedule/size_estimate.h"
#include "graph/function.h"

namespace retrograde::autoschedule {

// Moves those of the Funcs, all of which this scheduler has computed at root and given loops, into
// the loops of their only reader, if that is one of them, too. `but`: none of these, as a reader
// neither.
void compute_in_slices(const Readers& readers, const std::vector<FuncPtr>& stored,
                       const std::unordered_set<const Symbol*>& but, const SizeEstimate& sizes);

// Whether every read of f has the variable as one and the same index, but for clamps, and in no other;
// along it each element of f is computed for itself. The result: which index.
std::optional<size_t> sliced_by(const FuncContents& f, const Reader& reader,
                                const std::string& var);

}  // namespace retrograde::autoschedule
