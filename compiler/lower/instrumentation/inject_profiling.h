// inject_profiling -- tell the profiler which Func is being computed, by how many threads, in how
// much memory.
#pragma once

#include <string>

#include "lower/program.h"

namespace retrograde::lower {

Stmt inject_profiling(const Stmt& s, const Program& program, const std::string& pipeline);

}  // namespace retrograde::lower
