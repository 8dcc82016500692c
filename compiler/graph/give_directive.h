// give_directive.h -- the one place where schedules change.
//
// A directive is checked against the rules that can be known when it is given, applied to the
// schedule, and appended to the log of its Func: schedule_log.h puts the logs of a graph together.
// What depends on other Funcs' schedules is checked when the pipeline is compiled.
#pragma once

#include <string>
#include <vector>

#include "graph/function.h"

namespace retrograde::graph {

// Whose schedule: that of a Func, of one of its stages, or of a specialization of that.
struct SchedulePlace {
  FuncPtr f;
  int stage = -1;                 // -1: the Func as a whole
  std::vector<int> special = {};  // of the stage's specializations: which, and of that one which

  const Definition& definition() const { return f->stage(stage); }
  const StageLoops& schedule() const;
  std::string name() const;  // in quotes: "blur.update(0)"
};

// CompileError when a rule forbids it. Sizes become int32, and handles of levels levels.
void check_directive(const SchedulePlace& place, Directive& directive);
// Checks, applies and logs it. For all but those that make Funcs.
void give_directive(const SchedulePlace& place, Directive directive);
// Appends it to the log: of what makes Funcs, by who made them.
void log_directive(const SchedulePlace& place, Directive directive);

// Takes back all that was given to its stages: they have the loops again that they were defined with.
// Nothing may have been computed in these loops, or in the same loops as they.
void take_back_loops(FuncContents& f);

// Whether a directive was given to it or to one of its stages, other than of sizes.
bool is_touched(const FuncContents& f);

// The specialization of this schedule for the condition; -1: there is none.
int specialization_for(const StageLoops& schedule, const Expr& condition);
// Where the loop stands, innermost first; CompileError when it is none.
size_t loop_index(const SchedulePlace& place, const std::string& loop, const std::string& asked);
// CompileError when another loop than `replaced` is called so.
void check_new_loop(const SchedulePlace& place, const std::string& name,
                    const std::string& replaced, const std::string& asked);
// CompileError when it has no definition.
void check_is_defined(const FuncContents& f, const std::string& asked);

// The rules, one function for all directives of stages and one for those of Funcs.
void check_stage_directive(const SchedulePlace& place, Directive& directive);
void check_func_directive(const SchedulePlace& place, Directive& directive);

}  // namespace retrograde::graph
