// make_names_unique -- give every binding a unique name.
//
// In:  Loops, as build_loop_nests generates it: a Func that is computed at several places binds its names at each of
//      them, also at nested places. A name refers to the innermost binding around it.
// Out: the same program, in which every name is bound once. First bindings keep their names, unless an argument has the
//      same name.
//
//   produce g: realize f: ...                produce g: realize f: ...
//   produce h: realize f: ...       =>       produce h: realize f.$1: ...
//
// Method: one walk with a stack of renamings. Tests: test/unit/lower/lower_names_test.cpp.
#pragma once

#include <string>
#include <vector>

#include "ir/expr.h"

namespace retrograde::lower {

// `taken`: names that are visible in all of s, such as arguments of its function. original_name() gives the name back.
Stmt make_names_unique(const Stmt& s, const std::vector<std::string>& taken = {});

}  // namespace retrograde::lower
