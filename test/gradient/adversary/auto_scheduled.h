// Random programs and all of their gradients as one pipeline, which the compiler schedules.
#pragma once

#include "gradient/adversary/check.h"

namespace retrograde::gradient {

// Pipeline::auto_schedule gives a schedule that is legal wherever the pipeline runs at all; as text
// and back it gives a fresh copy the same loops; results agree with the interpreter, and have the
// same bits on 1, 2 and 3 threads and when run again. Extents are constant, one, parameters, or so
// large that the pipeline is compiled only. compiles_all: the replayed schedule is run too, and the
// one that a gradient gets when nobody asks.
Judged judge_auto_scheduled(Choices& choices, bool compiles_all);
std::string auto_scheduled_text(Choices& choices);

}  // namespace retrograde::gradient
