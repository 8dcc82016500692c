// make_names_unique -- give every binding a name of its own.
//
// In:  Loops, as build_loop_nests makes it: a Func that is computed at several places binds its
// names at each of them, nested
//      places included. Names mean the innermost binding around them.
// Out: the same program; every name is bound once. First bindings keep their names, unless an argument
// has it.
//
//   produce g: realize f: ...                produce g: realize f: ...
//   produce h: realize f: ...       =>       produce h: realize f.$1: ...
//
// Method: one walk with a stack of renamings. Tests: test/unit/lower_names_test.cpp.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "ir/expr.h"

namespace retrograde::lower {

struct UniqueNames {
  Stmt stmt;
  std::map<std::string, std::string> original;  // of each Func that was renamed
};
// `taken`: names that have a meaning in all of s, as arguments of its function do.
UniqueNames make_names_unique(const Stmt& s, const std::vector<std::string>& taken = {});

}  // namespace retrograde::lower
