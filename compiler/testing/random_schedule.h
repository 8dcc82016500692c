// Random legal schedules as logs: wrappers, clones and factored updates; where each Func is
// computed and stored, how, and the loops of each of its stages.
#pragma once

#include "graph/schedule_log.h"
#include "testing/programs/program.h"

namespace retrograde::fuzz {

// Names are those of the Funcs without the numbers that the process gives them: f0, r.x. What
// specializations compare with is a Param of the log's own. The program stays as it is.
// The style says how often, in a hundred Funcs, each placement is drawn.
struct ScheduleStyle {
  int inlined = 25;         // of pure ones; of others a third
  int at = 50;              // in a loop of another
  int stored_outside = 55;  // of those: further out than they are computed
  int most_nested = 3;      // Funcs computed in loops of each other

  static ScheduleStyle windows();  // sliding windows in sliding windows
};
ScheduleLog random_schedule(const RandomProgram& program, Choices& choices,
                            const ScheduleStyle& style = {});

// Gives it to the Funcs of a program.
inline void apply(const ScheduleLog& log, const RandomProgram& program) {
  graph::apply_log(log, outputs_of(program));
}

}  // namespace retrograde::fuzz
