// memoize -- look the results of memoized Funcs up before they are computed.
#pragma once

#include <map>
#include <string>

#include "ir/target.h"
#include "lower/program.h"

namespace retrograde::ir {

// Original names of Funcs that have others in the statement.
using RenamedFuncs = std::map<std::string, std::string>;

// Loops to Loops: names the key of each memoized Func. `function`: what is compiled.
Stmt add_memoization_keys(const Stmt& s, const Program& program, const RenamedFuncs& renamed,
                          const std::string& function, const Target& target);
// FlatStorage to FlatStorage, directly after flattening: turns the keys into lookups.
Stmt add_memoization_lookups(const Stmt& s, const Program& program, const RenamedFuncs& renamed);

}  // namespace retrograde::ir
