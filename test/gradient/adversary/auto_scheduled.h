// Checks the autoscheduler on random programs: one pipeline holds the program and all of its gradients.
#pragma once

#include <optional>

#include "gradient/adversary/check.h"

namespace retrograde::gradient {

// Judges a schedule by Pipeline::auto_schedule, or the default schedule of a gradient. It must be legal wherever the
// pipeline runs at all, and a fresh copy must get the same loops from its text. Results must agree with the
// interpreter, and have the same bits on 1, 2, 3 and 7 threads and in repeated runs.
//
// Extents are constant, one, parameters with and without estimates, or so large that the pipeline is only compiled;
// decisions may be switched off. Large programs are checked against the interpreter at a small size, and against serial
// loops at their own size. With compiles_all, the replayed schedule and the default schedule of the gradient run too.
//
// The counts in the result say which checks ran, which rules were seen (schedule_rules.h), and which programs used more
// memory than inputs, outputs and twice the largest Func of the program.
//
// workload: such programs instead of those of all kinds.
Judged judge_auto_scheduled(Choices& choices, bool compiles_all,
                            std::optional<fuzz::Workload> workload = {});
std::string auto_scheduled_text(Choices& choices, std::optional<fuzz::Workload> workload = {});

// Large programs that use more than `percent` of that memory are judged wrong; 0: no limit.
void limit_memory(int percent);

}  // namespace retrograde::gradient
