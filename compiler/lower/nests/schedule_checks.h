// schedule_checks.h -- what every call checks of the sizes in the schedule.
//
// Factors of splits, alignments of storage and moduli of bounds may be made of parameters. Loops
// and strides divide by them, so that 0 or less would leave points out or overlap rows.
#pragma once

#include <vector>

#include "ir/expr.h"
#include "lower/program.h"

namespace retrograde::lower {

// Assertions over parameters; none for what is constant, which the directives check.
std::vector<Stmt> schedule_checks(const Program& program);

}  // namespace retrograde::lower
