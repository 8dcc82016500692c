// bind_symbols.h -- attaches the Funcs, images and parameters of a program to a statement that was read from text.
#pragma once

#include "lower/program.h"

namespace retrograde::lower {

// Text holds no symbols (ir/parse.h). Calls, loads, prefetches and variables get those of the entities with their names;
// names that `program` and `parameters` lack stay as they are.
Stmt bind_symbols(const Stmt& s, const Program& program,
                  const std::vector<std::shared_ptr<ParameterContents>>& parameters);

}  // namespace retrograde::lower
