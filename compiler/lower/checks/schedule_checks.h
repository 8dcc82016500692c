// schedule_checks.h -- run-time checks of sizes in the schedule that depend on parameters.
//
// Factors of splits, alignments of storage and moduli of bounds may depend on parameters. Loops and strides divide by
// them, so a value of 0 or less would skip points or overlap rows.
#pragma once

#include <vector>

#include "ir/expr.h"
#include "lower/program.h"

namespace retrograde::lower {

// Assertions over parameters; constants are checked by the directives themselves.
std::vector<Stmt> schedule_checks(const Program& program);

}  // namespace retrograde::lower
