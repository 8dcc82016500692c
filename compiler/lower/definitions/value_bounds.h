// value_bounds -- bound the values of Funcs, as far as their definitions allow.
//
//   layer(x, y) = clamp(cast<int>(depth(x, y)), 0, 6)      =>   layer: [0, 6]
//
// A Func read at layer(x, y) then has a bounded region. Bounds hold for all coordinates and consist of constants and
// parameters. Cost: one pass of interval arithmetic over every definition.
#pragma once

#include "analysis/interval.h"
#include "lower/program.h"

namespace retrograde::lower {

ValueBounds value_bounds(const Program& program);

}  // namespace retrograde::lower
