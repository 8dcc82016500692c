// Loops over time that keep every step, rewritten to overwrite: what checkpoints need.
//
//   f(x, t) = start(x, t)             f_folded(x, s) = start(x, the time before the first step that
//                                                              belongs in slot s)
//   f(x, r + 1) = g(f(x, r))    =>    f_folded(x, (r + 1) % K) = g(f_folded(x, r % K))
//   last(x) = f(x, n)                 last'(x) = f_folded(x, n % K)
//
// where others read the last slices only (time_axis.h), which with those that a step reads fit into
// K slots: K = 1 where a step reads one step back at its own place. Funcs between f and the output
// are copied, so the program of the user stays as it is. Elements that no step writes are read from
// the pure definition. The folded loop is one of checkpoint.h: n steps take the memory of a few
// states.
//
// Where every step is read by others, f has to keep them all: it is left as it is.
#pragma once

#include "autodiff/sweeps/synthesis.h"

namespace retrograde::autodiff {

// synthesize_adjoints of the program folded. Adjoints of copies stand for those of their Funcs;
// folded Funcs have none, and explanations say so. A Func that was requested is not folded.
SynthesisResult synthesize_folded(const Seed& seed, SynthesisOptions options);

}  // namespace retrograde::autodiff
