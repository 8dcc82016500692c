// refuse_unsupported -- what no single directive could know when it was given, and what no CPU has.
#pragma once

#include "ir/target.h"
#include "lower/program.h"

namespace retrograde::lower {

// CompileError for schedules that contradict themselves; Unsupported for memory of devices.
void refuse_unsupported(const Program& program);

// CompileError for loops over blocks or threads where the target has no GPU.
void check_devices(const Program& program, const Target& target);

// CompileError for a Func that is substituted into its users and has a schedule that needs storage
// or a computation of its own.
void check_inlined(const FuncContents& f, const FuncPlacement& schedule);

// Var::outermost() as a level means outside of all loops of the Func: where that one is computed.
void resolve_outermost_levels(Program& program);

}  // namespace retrograde::lower
