// specialize -- one definition with several schedules, each for when a condition over parameters
// holds.
//
//   f(x) = select(p, g(x), h(x));  f.specialize(p)     =>     if (p) for x: f(x) = g(x)
//                                                             else   for x: f(x) = h(x)
//
// Method: the definition is simplified with what is known in each branch, before regions are
// inferred, so that what a branch does not read is not computed for it. What a comparison implies
// beyond itself is found later, where the statement is simplified. Not done: conditions that data
// decides. Tests: test/unit/specialize_test.cpp.
#pragma once

#include <string>
#include <vector>

#include "lower/program.h"

namespace retrograde::lower {

struct Variant {
  Expr condition;       // of this one, when none before it held; undefined: always
  std::string failure;  // not empty: nothing is computed, the call reports this
  LoopedFunc func;      // whose stage has this schedule, without specializations of its own level
};

// In the order in which they are tried; the last has no condition. Only the one with the plain
// schedule when there are no specializations.
std::vector<Variant> variants_of(const LoopedFunc& f, int stage);

// Every schedule that a definition may run with: its own, and those of all specializations.
std::vector<const StageLoops*> schedules_of(const StageLoops& schedule);

// What a call reports that comes to a specialize_fail.
Stmt fail_specialized(const LoopedFunc& f, const std::string& message);

}  // namespace retrograde::lower
