// value_bounds -- between what values a Func lies, as far as its definitions tell.
//
//   layer(x, y) = clamp(cast<int>(depth(x, y)), 0, 6)      =>   layer: [0, 6]
//
// So that a Func read at layer(x, y) has a bounded region. Coordinates may be anything; what is
// left are constants and parameters. Cost: one pass of interval arithmetic over every definition.
#pragma once

#include "analysis/interval.h"
#include "lower/program.h"

namespace retrograde::lower {

ValueBounds value_bounds(const Program& program);

}  // namespace retrograde::lower
