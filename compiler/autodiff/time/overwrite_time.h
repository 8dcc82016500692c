// overwrite_time.h -- rewrites loops over time that keep every step, so that they overwrite and can be checkpointed.
//
//   f(x, t) = start(x, t)             f_folded(x, s) = start(x, the time before the first step that
//                                                               belongs in slot s)
//   f(x, r + 1) = g(f(x, r))    =>    f_folded(x, (r + 1) % K) = g(f_folded(x, r % K))
//   last(x) = f(x, n)                 last'(x) = f_folded(x, n % K)
//
// This applies if other Funcs read only the last slices (time_axis.h). These and the slices that a step reads must fit
// into K slots: K = 1 if a step reads its own element one step back. Funcs between f and the outputs are copied, so the
// user's program does not change. Elements that no step writes are read from the pure definition. The folded loop is
// one for checkpoint.h: n steps take the memory of a few states.
//
// If other Funcs read every step, f must keep them all and is not rewritten.
#pragma once

#include "autodiff/sweeps/synthesis.h"

namespace retrograde::autodiff {

// Calls synthesize_adjoints on the folded program. Adjoints of copies are reported as those of the original Funcs.
// Folded Funcs have no adjoint, and explanations say so. Requested Funcs and outputs are not folded.
SynthesisResult synthesize_folded(const Seeds& seeds, SynthesisOptions options);

}  // namespace retrograde::autodiff
