// A sane schedule for Funcs that differentiation made and that nobody scheduled.
//
// Inlining an adjoint into every reader multiplies work: a chain of n stencils with k taps costs
// k^n. So, in a pipeline that contains adjoints, an untouched Func is computed at root when it
// reduces, scatters, or costs more to compute again at its reads (read_estimate.h) than a way to
// memory and back does. Its innermost dimension is vectorized, its outermost run in parallel; a
// stage that reads across rows is tiled; a reduction keeps a tile of its sums in registers
// (register_tile.h); a scatter along its reduction domain computes places and
// terms in vectors. That goes for primal Funcs too, which both directions read. A directive of the
// user on a Func or one of its stages switches this off for that Func. Where the user scheduled
// part of the primal, its other pure Funcs stay inline unless that explodes; but a scan, and a
// reduction that is read again and again, is stored: inside of the loops of who reads it, all of it
// would run for each element. Pipelines without adjoints are left as they are.
#pragma once

#include <unordered_map>
#include <vector>

#include "autodiff/schedule/register_tile.h"
#include "graph/function.h"

namespace retrograde::ir {

// Whether a directive was given to it or to one of its stages.
bool is_touched(const FuncContents& f);

struct ChosenSchedule {
  FuncPlacement func;
  std::vector<StageLoops> stages;
};
// Chosen schedules by Func; a Func that is not here keeps its own. The Funcs are not changed.
using DefaultSchedules = std::unordered_map<const FuncContents*, ChosenSchedule>;
DefaultSchedules default_schedules(const std::vector<FuncPtr>& outputs,
                                   const VectorUnit& unit = {});

// The pass: the outputs with their wrappers applied, or, where schedules are chosen, of a copy of
// the graph that has them. What lowering is given.
std::vector<FuncPtr> schedule_unscheduled(const std::vector<FuncPtr>& outputs,
                                          const VectorUnit& unit = {});

}  // namespace retrograde::ir
