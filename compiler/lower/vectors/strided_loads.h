// strided_loads.h -- finds vector loads with a constant stride, and groups loads of neighbouring elements.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "ir/visit.h"

namespace retrograde::lower {

struct StridedLoad {
  Expr load, base;
  int64_t stride;
  int64_t offset = 0;  // distance of `base` from the base of the first load in its family
  const Load& node() const { return *load.as<Load>(); }
};
// The load `e` of base + stride i, if it has no predicate, a scalar base and a constant stride.
std::optional<StridedLoad> as_strided(const Expr& e);

// Loads of one buffer with the same stride and number of lanes, whose bases differ by constants.
using StridedFamily = std::vector<StridedLoad>;
// Adds the load to the family that it belongs to, or starts a new family.
void add_to_family(StridedLoad load, std::vector<StridedFamily>& families);

}  // namespace retrograde::lower
