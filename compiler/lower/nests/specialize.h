// specialize -- give a definition several schedules that are chosen by conditions over parameters.
//
//   f(x) = select(p, g(x), h(x));  f.specialize(p)     =>     if (p) for x: f(x) = g(x)
//                                                             else   for x: f(x) = h(x)
//
// Method: the definition is simplified under the condition of each branch before regions are inferred, so that a branch
// does not compute regions that it does not read. Consequences of a comparison are found later, when the statement is
// simplified. Not done: conditions that depend on data. Tests: test/unit/lower/specialize_test.cpp.
#pragma once

#include <string>
#include <vector>

#include "lower/program.h"

namespace retrograde::lower {

struct Variant {
  Expr condition;  // applies if no condition of an earlier variant holds; undefined: always true
  std::string failure;  // if not empty, nothing is computed and the call fails with this message
  LoopedFunc
      func;  // its stage has this variant's schedule, without specializations of the same level
};

// The variants in the order in which they are tried; the last has no condition. Without specializations, only the plain
// schedule.
std::vector<Variant> variants_of(const LoopedFunc& f, int stage);

// Every schedule that a definition may run with: its own and those of all specializations.
std::vector<const StageLoops*> schedules_of(const StageLoops& schedule);

// The statement of a call that reaches a specialize_fail.
Stmt fail_specialized(const LoopedFunc& f, const std::string& message);

}  // namespace retrograde::lower
