// Extents and elements of isl sets of integer tuples without parameters.
#pragma once

#include <isl/cpp.h>

#include <cstdint>
#include <optional>
#include <vector>

#include "simplify/facts.h"

namespace retrograde::autodiff {

// Least and largest of each coordinate; nullopt when one has no bound, or the set is empty.
std::optional<std::vector<ConstantRange>> ranges_of(const isl::set& s);

// All elements in lexicographic order; nullopt when there are more than `most`, or they take too
// long to find.
std::optional<std::vector<std::vector<int64_t>>> points_of(const isl::set& s, int64_t most);

}  // namespace retrograde::autodiff
