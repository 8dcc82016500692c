// likely_clamps -- a clamped index is inside of its limits for most iterations.
//
//   g(x) = f(clamp(x - 1, 0, w - 1))  =>  g(x) = f(clamp(likely(x - 1), 0, w - 1))
//
// So partition_loops makes dense loads of what would be gathers, as it does for a boundary
// condition: users write the clamp as often as the condition. Marked is what the loops of a stage
// alone decide, between limits that they do not move, in the indices of what it reads: a place that
// data decide may lie anywhere, and so may one whose limits move along.
//
// Not done: the indices of a Func that its own update reads, and what these read in turn: they say by
// being the same as those that it stores to that the update accumulates.
// Source: ours, of what partition_loops says of likely. Tests: test/unit/likely_clamps_test.cpp.
#pragma once

#include "lower/program.h"

namespace retrograde::lower {

void mark_likely_clamps(Program& program);

}  // namespace retrograde::lower
