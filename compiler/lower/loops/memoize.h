// memoize -- look up the results of memoized Funcs in a cache before computing them.
#pragma once

#include <string>

#include "analysis/interval.h"
#include "ir/target.h"
#include "lower/program.h"

namespace retrograde::lower {

// Wraps `storage` of a memoized Func in lets that hold the region that its consumers read, which becomes part of the
// key. Storage may be larger: the part that only a rounded split computes holds no valid values of the Func.
Stmt with_key_region(const std::string& func, const Box& read, Stmt storage);

// `function`: the name of the compiled function.
Stmt memoize(const Stmt& s, const Program& program, const std::string& function,
             const Target& target);

}  // namespace retrograde::lower
