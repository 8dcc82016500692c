// share_parameters -- large integers of parameters alone get names, bound once at the root.
//
// In:  a Program (definitions as DAGs over pure variables, reduction variables and parameters).
// Out: the same, in which no integer of parameters alone is larger than a few nodes; the names.
//
//   f(x) = g(min(x, (w + 6) / 8 * 4 + 3))        let shared.0 = (w + 6) / 8
//   h(x) = f(min(x, ((w + 6) / 8 + 1) / 2))  =>  f(x) = g(min(x, shared.0 * 4 + 3))  ...
//
// Why: the regions of a pyramid's levels are such integers, each a division of the last one. Bounds
// inference puts them into each other; as trees they double with each level, and every loop that
// has a condition on them would say all of it. Method: children first; what is large in terms of
// the names found below it becomes a name. Equal ones are one. Not done: in programs with a
// memoized Func, whose key is made of the parameters that it mentions.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "lower/program.h"

namespace retrograde::lower {

// Each may use those before it.
std::vector<std::pair<std::string, Expr>> share_parameters(Program& program);

}  // namespace retrograde::lower
