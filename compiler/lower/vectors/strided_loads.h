// strided_loads.h -- loads that pick elements at equal distances, together with those beside them.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "ir/visit.h"

namespace retrograde::lower {

struct StridedLoad {
  Expr load, base;
  int64_t stride;
  int64_t offset = 0;  // from the base of its family
  const Load& node() const { return *load.as<Load>(); }
};
// Of a load without a predicate at base + stride i, of a scalar base and a constant stride.
std::optional<StridedLoad> as_strided(const Expr& e);

// Loads of one buffer with one stride and number of lanes, at constant distances.
using StridedFamily = std::vector<StridedLoad>;
// Into the family that it belongs to, or one of its own.
void add_to_family(StridedLoad load, std::vector<StridedFamily>& families);

}  // namespace retrograde::lower
