// Random legal schedules as logs: wrappers, clones and factored updates; where each Func is
// computed and stored, how, and the loops of each of its stages.
#pragma once

#include "graph/schedule_log.h"
#include "testing/programs/program.h"

namespace retrograde::fuzz {

// Names are those of the Funcs without the numbers that the process gives them: f0, r.x. What
// specializations compare with is a Param of the log's own. The program stays as it is.
ScheduleLog random_schedule(const RandomProgram& program, Choices& choices);

// Gives it to the Funcs of a program.
inline void apply(const ScheduleLog& log, const RandomProgram& program) {
  graph::apply_log(log, outputs_of(program));
}

}  // namespace retrograde::fuzz
