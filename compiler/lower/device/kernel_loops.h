// kernel_loops.h -- which loops become which kernel, for reports.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "ir/expr.h"

namespace retrograde::lower {

// By stage, the loops over blocks and threads of a kernel, outermost first:
// "out: blocks y, x, threads yi, xi", "out.update(0): blocks x, threads xi", "rows: threads y, x".
using KernelLoops = std::vector<std::string>;

// By the names of launches; of a statement as make_kernels is given it, and as it gives it.
std::map<std::string, KernelLoops> loops_of_kernels(const Stmt& before, const Stmt& after);

}  // namespace retrograde::lower
