// Shrinks a failing program: tries smaller descriptions, keeps those that still fail.
#pragma once

#include <functional>

#include "testing/random_schedule.h"

namespace retrograde::fuzz {

struct Program {
  PipelineSpec pipeline;
  ScheduleLog schedule;
};

// Must be true of the program given and of every program kept; false for programs that are illegal.
using StillFails = std::function<bool(const Program&)>;

// Greedy, to a fixed point or until `max_trials` programs were tried. Tries, coarse to fine: fewer
// outputs, no updates, default schedules, fewer directives, smaller regions and domains, terms
// replaced by an operand or a constant, indices without offsets.
Program shrink(Program program, const StillFails& still_fails, int max_trials = 2000);

}  // namespace retrograde::fuzz
