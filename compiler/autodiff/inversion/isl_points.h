// isl_points.h -- ranges and elements of isl sets of integer tuples without parameters.
#pragma once

#include <isl/cpp.h>

#include <cstdint>
#include <optional>
#include <vector>

#include "simplify/facts.h"

namespace retrograde::autodiff {

// The smallest and largest value of each coordinate; nullopt if one is unbounded, or if the set is empty.
std::optional<std::vector<ConstantRange>> ranges_of(const isl::set& s);

// All elements in lexicographic order; nullopt if there are more than `most` or finding them takes too long.
std::optional<std::vector<std::vector<int64_t>>> points_of(const isl::set& s, int64_t most);

}  // namespace retrograde::autodiff
