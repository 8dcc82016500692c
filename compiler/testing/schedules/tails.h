// tails.h -- random legal strategies for the tails of split loops.
//
// Outputs are rounded up or shifted inwards only if the extents of all runs allow it.
#pragma once

#include "testing/random_loops.h"

namespace retrograde::fuzz {

// Draws the strategy for a loop of the stage that is split by the factor.
TailStrategy random_tail(const Loop& loop, int factor, const StageContext& stage, Choices& random);

}  // namespace retrograde::fuzz
