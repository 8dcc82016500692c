// insert_prefetches -- prefetch the data that later iterations of a loop read.
#pragma once

#include "lower/program.h"

namespace retrograde::lower {

// Loops to Loops: inserts a Prefetch of a box into each loop that a prefetch directive names.
Stmt insert_prefetches(const Stmt& s, const Program& program);
// Loops to Loops: Prefetches become loops over the cache lines of their boxes.
Stmt lower_prefetches(const Stmt& s, const Program& program);

}  // namespace retrograde::lower
