// own_joining -- check an update that runs in the loops of the stage before it (compute_with).
//
//   f(x, y) = 0;  f(x, y) += g(x, y, r)           for y: for x: f = 0
//   f.update().compute_with(Stage(f), y)   =>              for x: for r: f += ...
//
// A tile of sums is then initialised while it is in the cache. In every iteration of the shared loops, the update must
// access exactly the elements that the stage before has computed in that iteration: the loops are the same parts of the
// same dimensions, and the stage before computes no element twice. If a shared loop is no pure dimension of the update,
// the update of each element must also read no other element. A scan  f(r, y) += f(r - 1, y)  can share the loop over y.
// Tests: test/unit/lower/compute_with_test.cpp, test/error/compute_with_errors_test.cpp.
#pragma once

#include <string>

#include "lower/checks/fusing_checks.h"

namespace retrograde::lower {

// Whether the stage joins an earlier stage of its own Func.
bool is_own(const Joining& joining);

// CompileError unless the update accesses, in each iteration of the shared loops, only elements of that iteration.
void check_own_joining(const Program& program, const Joining& joining);

// Whether later stages of the Func run in the loops of this one; its tiles must not overlap then.
bool hosts_own_updates(const LoopedFunc& f, int stage);

// The last of the later stages that run in this loop of the stage, directly or through one another; the stage itself if
// there is none.
int last_stage_in(const LoopedFunc& f, int stage, const std::string& loop);

}  // namespace retrograde::lower
