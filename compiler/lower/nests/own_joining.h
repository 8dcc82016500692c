// own_joining -- an update in the loops of the stage before it.
//
//   f(x, y) = 0;  f(x, y) += g(x, y, r)           for y: for x: f = 0
//   f.update().compute_with(Stage(f), y)   =>              for x: for r: f += ...
//
// A tile of sums starts where it is in the cache. Every iteration of the shared loops must touch
// the elements that the stage before has made in the same iteration, and no others: the loops are
// the same parts of the same dimensions, the stage before makes no element twice, and the update
// changes each element by what that holds alone.
// Tests: test/unit/compute_with_test.cpp, test/error/compute_with_errors_test.cpp.
#pragma once

#include <string>

#include "lower/nests/fusing_checks.h"

namespace retrograde::lower {

// The stage joins the one before it.
bool is_own(const Joining& joining);

// CompileError unless an iteration of the shared loops is all that the update touches.
void check_own_joining(const Program& program, const Joining& joining);

// Whether stages after this one run in its loops: its tiles must not overlap then.
bool hosts_own_updates(const LoopedFunc& f, int stage);

// The last of the stages after this one that run, one in the loops of the other, in this loop of it;
// itself where none does.
int last_stage_in(const LoopedFunc& f, int stage, const std::string& loop);

}  // namespace retrograde::lower
