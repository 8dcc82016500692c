// ring_buffers -- give hoisted storage several copies that iterations use in turn.
#pragma once

#include <string>

#include "ir/expr.h"
#include "lower/program.h"

namespace retrograde::lower {

// Loops -> Loops. The hoisted storage of Funcs with a ring buffer, and the Realizes of these Funcs, get one bound more
// than dimensions, which flatten_storage reads. For the hoisted storage it is the number of copies, for the Func the
// first element of its copy.
Stmt ring_buffers(const Stmt& s, const Program& program);

// The constant number of copies of an async Func.
int copies_in_ring(const LoopedFunc& f);
// Reports that the loops of an async Func do not allow a ring buffer.
[[noreturn]] void refuse_ring(const LoopedFunc& f, const std::string& evidence);

}  // namespace retrograde::lower
