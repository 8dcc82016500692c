// memory_order -- orders the Funcs computed at root so that few of them are in memory at once
// (graph/computing_order.h).
#pragma once

#include "lower/program.h"

namespace retrograde::lower {

void order_for_memory(Program& program);

}  // namespace retrograde::lower
