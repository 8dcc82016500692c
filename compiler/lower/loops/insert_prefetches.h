// insert_prefetches -- ask for what later iterations read.
#pragma once

#include "lower/program.h"

namespace retrograde::lower {

// Loops to Loops: a Prefetch of a box in the loops that schedules name.
Stmt insert_prefetches(const Stmt& s, const Program& program);
// Loops to Loops: Prefetches become loops over the cache lines of their boxes.
Stmt lower_prefetches(const Stmt& s, const Program& program);

}  // namespace retrograde::lower
