// ring_buffers -- give hoisted storage several copies that iterations use in turn.
#pragma once

#include <string>

#include "ir/expr.h"
#include "lower/program.h"

namespace retrograde::lower {

// Loops to Loops. The hoisted storage of Funcs with a ring buffer gets one dimension more, the number of copies. The
// layouts of these Funcs get the first element of their copy.
Stmt ring_buffers(const Stmt& s, const Program& program);

// The constant number of copies of an async Func.
int copies_in_ring(const LoopedFunc& f);
// Reports that the loops of an async Func do not allow a ring buffer.
[[noreturn]] void refuse_ring(const LoopedFunc& f, const std::string& evidence);

}  // namespace retrograde::lower
