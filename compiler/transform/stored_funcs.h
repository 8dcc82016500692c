// stored_funcs.h -- the unscheduled Funcs that a count of operations takes as stored, not inlined.
//
// Inlining an adjoint into every reader multiplies work: a chain of n stencils with k taps costs k^n. So a Func counts as
// stored if it reduces, scatters, or costs more to recompute at its reads (read_estimate.h) than a memory round trip. A directive of the user on a Func or one of its stages decides for it. Where the user scheduled part of the
// primal, its other pure Funcs count as inlined unless that explodes. A schedule may store others: it weighs sizes, too.
#pragma once

#include <vector>

#include "graph/function.h"

namespace retrograde::transform {

// In a pipeline without adjoints only what inlining would copy without end (transform/large_bodies.h).
std::vector<FuncPtr> stored_by_default(const std::vector<FuncPtr>& outputs);

}  // namespace retrograde::transform
