// ring_buffers -- several copies of hoisted storage, used in turn.
#pragma once

#include <string>

#include "ir/expr.h"
#include "lower/program.h"

namespace retrograde::lower {

// Loops -> Loops. Places of Funcs with a ring buffer, and these Funcs' Realizes, have one bound more
// than dimensions, which flatten_storage reads: of the place the number of copies, of the Func the
// element that its copy begins with.
Stmt ring_buffers(const Stmt& s, const Program& program);

// How many copies an async Func has.
int copies_in_ring(const LoopedFunc& f);
// Iterations of an async Func have no copies that are used in turn.
[[noreturn]] void refuse_ring(const LoopedFunc& f, const std::string& evidence);

}  // namespace retrograde::lower
