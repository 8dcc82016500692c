// likely_clamps -- mark clamped indices as likely to be inside of their limits.
//
//   g(x) = f(clamp(x - 1, 0, w - 1))  =>  g(x) = f(clamp(likely(x - 1), 0, w - 1))
//
// partition_loops then turns gathers into dense loads, as it does for boundary conditions; users write clamps as often
// as boundary conditions. A clamped index in a stage's reads is marked if it depends only on the stage's loops, with
// limits that do not depend on them. Data-dependent indices may lie anywhere, and so may indices whose limits vary.
//
// Not done: indices with which an update reads its own Func, and indices inside of those. The update is recognised as
//           an accumulation because they equal the indices of its store.
// Source: our own, based on the meaning of likely in partition_loops. Tests: test/unit/lower/likely_clamps_test.cpp.
#pragma once

#include "lower/program.h"

namespace retrograde::lower {

void mark_likely_clamps(Program& program);

}  // namespace retrograde::lower
