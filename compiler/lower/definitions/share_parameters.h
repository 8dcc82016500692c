// share_parameters -- bind large integer expressions of parameters to names at the root.
//
// In:  a Program (definitions as DAGs over pure variables, reduction variables and parameters).
// Out: the same program, in which integer expressions of parameters have at most a few nodes; and the names.
//
//   f(x) = g(min(x, (w + 6) / 8 * 4 + 3))        let shared.0 = (w + 6) / 8
//   h(x) = f(min(x, ((w + 6) / 8 + 1) / 2))  =>  f(x) = g(min(x, shared.0 * 4 + 3))  ...
//
// Why: the regions of a pyramid's levels are such expressions, each a division of the last one. Bounds inference
//      substitutes them into each other; as trees their size doubles with each level, in every loop that has a
//      condition on them.
// Method: children first; an expression that is large in terms of the names found below it gets a name. Equal
//         expressions share one.
// Not done: programs with a memoized Func, whose key consists of the parameters that it mentions.
#pragma once

#include "lower/program.h"

namespace retrograde::lower {

// Fills program.shared; values may use names bound before them.
void share_parameters(Program& program);

}  // namespace retrograde::lower
