// stage_id.h -- the numbers by which the autoscheduler names Funcs and their stages.
#pragma once

#include <compare>
#include <cstdint>

namespace retrograde::planning {

using FuncId = int32_t;  // in graph::topological_order: producers before consumers

struct StageId {
  FuncId func = -1;
  int16_t stage = 0;  // 0: the pure definition
  auto operator<=>(const StageId&) const = default;
};

}  // namespace retrograde::planning
