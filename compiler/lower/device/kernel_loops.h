// kernel_loops.h -- lists the loops that each kernel was made from, for reports.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "ir/expr.h"

namespace retrograde::lower {

// One line per stage with the loops over blocks and threads that became the kernel, outermost first:
// "out: blocks y, x, threads yi, xi", "out.update(0): blocks x, threads xi", "rows: threads y, x".
using KernelLoops = std::vector<std::string>;

// Keyed by the names of launches. `before` and `after` are the statements before and after make_kernels.
std::map<std::string, KernelLoops> loops_of_kernels(const Stmt& before, const Stmt& after);

}  // namespace retrograde::lower
