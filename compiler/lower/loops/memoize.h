// memoize -- look the results of memoized Funcs up before they are computed.
#pragma once

#include <map>
#include <string>

#include "analysis/interval.h"
#include "ir/target.h"
#include "lower/program.h"

namespace retrograde::lower {

// By original name: what each dimension of its storage folds by, undefined where it does not.
using StorageFolds = std::map<std::string, std::vector<Expr>>;

// `storage` of a memoized Func, with the region that its consumers read of it, which a key names.
// Storage may be larger: what a rounded split computes beyond holds no values of the Func.
Stmt with_key_region(const std::string& func, const Box& read, Stmt storage);

// `function`: what is compiled.
Stmt memoize(const Stmt& s, const Program& program, const std::string& function,
             const Target& target, const StorageFolds& folds);

}  // namespace retrograde::lower
