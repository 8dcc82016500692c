// memoize -- look the results of memoized Funcs up before they are computed.
#pragma once

#include <map>
#include <string>

#include "ir/target.h"
#include "lower/program.h"

namespace retrograde::ir {

// By original name: what each dimension of its storage folds by, undefined where it does not.
using StorageFolds = std::map<std::string, std::vector<Expr>>;

// The let around the storage of a memoized Func that holds how much of it is computed, where
// bound_storage or align_storage make it larger.
std::string computed_extent_name(const std::string& func, size_t dimension);

// `function`: what is compiled.
Stmt memoize(const Stmt& s, const Program& program, const std::string& function,
             const Target& target, const StorageFolds& folds);

}  // namespace retrograde::ir
