// inject_profiling -- report to the profiler which Func each thread computes, and how much memory is allocated.
#pragma once

#include <string>

#include "lower/program.h"

namespace retrograde::lower {

Stmt inject_profiling(const Stmt& s, const Program& program, const std::string& pipeline);

}  // namespace retrograde::lower
