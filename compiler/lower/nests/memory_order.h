// memory_order -- the order in which Funcs are computed (graph/computing_order.h).
#pragma once

#include "lower/program.h"

namespace retrograde::lower {

void order_for_memory(Program& program);

}  // namespace retrograde::lower
