// inline_functions -- replace calls of Funcs that are scheduled inline by their definitions.
//
//   f(x) = x + 1 (inline)          g(x) = ((x - 1) + 1) * ((x + 1) + 1)
//   g(x) = f(x - 1) * f(x + 1)  =>
//
// Method: producers first, so that substituted values contain no inlined calls; memoised by node identity, so a
//         definition stays a DAG of linear size however often an argument is used. Inlining exposes every undef and
//         every coordinate, so resolve_undef, strict_indices and likely_clamps run here.
// Not done: Funcs with updates (see LoopedFunc::is_computed_innermost) and outputs.
// Source: folklore. Tests: test/unit/lower/loop_nest_test.cpp, test/property.
#pragma once

#include "lower/program.h"

namespace retrograde::lower {

Program inline_functions(const std::vector<FuncPtr>& outputs);

}  // namespace retrograde::lower
