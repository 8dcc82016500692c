// random_schedule.h -- random legal schedules as logs.
//
// They have wrappers, clones and factored updates, compute and storage levels of each Func, and directives for the
// loops of each of its stages.
#pragma once

#include "graph/directives/schedule_log.h"
#include "testing/programs/program.h"

namespace retrograde::fuzz {

// How often each placement is drawn, in percent of the Funcs.
struct ScheduleStyle {
  int inlined = 25;         // pure Funcs; a third of this for others
  int at = 50;              // computed in a loop of another Func
  int stored_outside = 55;  // of these, stored further out than computed
  int most_nested = 3;      // Funcs computed in loops of each other

  static ScheduleStyle windows();  // sliding windows in sliding windows
};
// Names are those of the Funcs without the numbers of this process: f0, r.x. Specializations compare with a Param that
// belongs to the log. The program is not changed.
ScheduleLog random_schedule(const RandomProgram& program, Choices& choices,
                            const ScheduleStyle& style = {});

// Applies the schedule to the Funcs of a program.
inline void apply(const ScheduleLog& log, const RandomProgram& program) {
  graph::apply_log(log, outputs_of(program));
}

}  // namespace retrograde::fuzz
