// fork_async -- run async producers concurrently with their consumers.
#pragma once

#include "lower/program.h"

namespace retrograde::lower {

// Loops to Loops. Names are unique before and after: a Func that both branches compute gets a new name in one of them.
Stmt fork_async(const Stmt& s, const Program& program);

}  // namespace retrograde::lower
