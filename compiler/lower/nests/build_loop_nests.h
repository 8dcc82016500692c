// build_loop_nests -- from Funcs and schedules to loops, with every region inferred on the way.
//
// In:  a Program (definitions as DAGs, nothing inlined left).
// Out: Nests phase. One statement for all outputs; each Func is realised at its storage level and
//      produced at its compute level over exactly the box that the code below reads; the boxes are
//      bound to names "f.s0.x.min" / "f.s0.x.max" just outside. root_statement.h describes its head.
//
//   out(x, y) = f(x - 1, y) + f(x + 1, y)        for out.s0.y:
//   f at out's y                                   let f.s0.x.max = out.s0.x.max + 1 ...
//                                           =>     realize f [..]:
//                                                    produce f: for f.s0.x: f(..) = ..
//                                                    for out.s0.x: out(..) = f(..) + f(..)
//
// Method: one walk over the tree of loops, consumers before producers. Going up from an innermost
// body, `uses` holds the box that everything below reads of each Func, in terms of the loop
// variables above. At a loop where a Func is to be computed its box is final: its loops are emitted
// there, and what it reads joins `uses`. Each Func is visited once per place it is computed and
// each box is bound to a name at its site, so time and code grow linearly with the pipeline. A Func
// stored further out than it is computed slides (sliding_window.h) and folds (storage_folding.h).
// Source: the scheduling model of Ragan-Kelley et al., PLDI 2013, section 4.2; the single bottom-up
// walk is ours. Tests: test/unit/lower/loop_nest_test.cpp, sliding_window_test.cpp, test/property.
#pragma once

#include "lower/program.h"

namespace retrograde::lower {

struct LoopNestOptions {
  bool slide = true;  // false: each Func computed whole wherever it is computed, as users wrote it
};

// UserError: a compute or storage level that is no loop around every use, an unbounded region, a
// Func stored outside of a parallel loop in which it is computed.
Stmt build_loop_nests(const Program& program, const LoopNestOptions& options = {});

}  // namespace retrograde::lower
