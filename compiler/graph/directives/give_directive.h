// give_directive.h -- the only place that changes schedules.
//
// A directive is checked against the rules that can be decided at once, applied to the schedule,
// and appended to the log of its Func; schedule_log.h merges the logs of a graph. Rules that depend
// on other Funcs' schedules are checked when the pipeline is compiled.
#pragma once

#include <string>
#include <vector>

#include "graph/function.h"

namespace retrograde::graph {

// The target of a directive: a Func, one of its stages, or a specialization of a stage.
struct SchedulePlace {
  FuncPtr f;
  int stage = -1;                 // -1: the Func as a whole
  std::vector<int> special = {};  // path to a nested specialization: an index for each level

  const Definition& definition() const { return f->stage(stage); }
  const StageLoops& schedule() const;
  std::string name() const;  // in quotes: "blur.update(0)"
};

// CompileError when a rule forbids the directive. Converts sizes to int32 and resolves LoopLevel
// objects.
void check_directive(const SchedulePlace& place, Directive& directive);
// Checks, applies and logs a directive. Not for directives that create Funcs.
void give_directive(const SchedulePlace& place, Directive directive);
// The same for one kind of directive. A user's program then compiles without the special members of
// the variant, which would take a third of the compile time of a short program.
template <typename D>
void give_directive(const SchedulePlace& place, D directive);
// Only appends the directive to the log. Directives that create Funcs are applied and logged by
// their creators.
void log_directive(const SchedulePlace& place, Directive directive);

// Resets the schedules of all stages to the loops of their definitions. No Func may be computed in
// these loops or fused with them. Where rfactor changed a definition, its loops keep the names that rfactor gave them, and
// the log keeps the directives up to that.
void reset_loops(FuncContents& f);
// The names that rfactor gave to loops of the stage's definition.
std::vector<Split> factored_names(const FuncContents& f, int stage);
// Whether the log of the Func, and those of the Funcs that its rfactors made, still replay after reset_loops and other
// directives: before an rfactor, directives only split and ordered the loops of its reduction.
bool can_reset_loops(const FuncContents& f);

// Whether the Func or one of its stages has directives, apart from those about sizes (bounds,
// alignments of bounds, estimates).
bool has_directives(const FuncContents& f);

// The index of this schedule's specialization for the condition; -1 when there is none.
int specialization_for(const StageLoops& schedule, const Expr& condition);
// The position of the loop, innermost first; CompileError when it does not exist.
size_t loop_index(const SchedulePlace& place, const std::string& loop, const std::string& asked);
// CompileError when a loop other than `replaced` has this name.
void check_new_loop(const SchedulePlace& place, const std::string& name,
                    const std::string& replaced, const std::string& asked);
// CompileError when the Func has no definition.
void check_is_defined(const FuncContents& f, const std::string& asked);

// The rules of all directives: one function for stages, one for Funcs.
void check_stage_directive(const SchedulePlace& place, Directive& directive);
void check_func_directive(const SchedulePlace& place, Directive& directive);

}  // namespace retrograde::graph
