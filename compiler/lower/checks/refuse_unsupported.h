// refuse_unsupported -- reject schedules whose directives contradict each other or need hardware that the target lacks.
#pragma once

#include "ir/target.h"
#include "lower/program.h"

namespace retrograde::lower {

// CompileError for contradictory schedules; Unsupported for memory types of devices that are not supported.
void refuse_unsupported(const Program& program);

// CompileError for loops over blocks or threads if the target has no GPU.
void check_devices(const Program& program, const Target& target);

// CompileError for a Func that is inlined into its consumers but has directives that need storage or loops of its own.
void check_inlined(const FuncContents& f, const FuncPlacement& schedule);

// Var::outermost() as a level means outside of all loops of the Func, which is the Func's own compute level.
void resolve_outermost_levels(Program& program);

}  // namespace retrograde::lower
