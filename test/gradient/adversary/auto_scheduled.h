// Random programs and all of their gradients as one pipeline, which the compiler schedules.
#pragma once

#include "gradient/adversary/check.h"

namespace retrograde::gradient {

// The schedule that Pipeline::auto_schedule gives, or that a gradient gets when nobody asks, is legal
// wherever the pipeline runs at all; as text and back it gives a fresh copy the same loops; results
// agree with the interpreter, and have the same bits on 1, 2, 3 and 7 threads and when run again.
// Extents are constant, one, parameters with and without estimates, or so large that the pipeline is
// compiled only; decisions may be switched off. Large programs are checked at a small size so, and at
// their own against serial loops. compiles_all: the replayed schedule is run too, and the one that a
// gradient gets when nobody asks.
// Counts: what was done, which rules were seen (schedule_rules.h), what used more memory than inputs,
// outputs and twice the largest Func of the program.
Judged judge_auto_scheduled(Choices& choices, bool compiles_all);
std::string auto_scheduled_text(Choices& choices);

// A large program that uses more memory than so many percent of that is judged wrong; 0: none is.
void limit_memory(int percent);

}  // namespace retrograde::gradient
