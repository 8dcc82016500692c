// storage_folding -- decide which dimensions of a Func's storage may fold, that is wrap around.
//
//   f is stored outside of the loop over y, each iteration of which accesses rows y - 1 .. y + 1 of it:
//
//   realize f [0, w], [-1, h + 2]      =>      storage of w * 4 elements; row y is at y & 3
//
// Method: visits the loops between computation and storage from the outermost inwards. A dimension of which one
//         iteration accesses at most a constant number of coordinates folds to the next power of two. If iterations
//         pass values on to the next ones, the window must move in one direction, so that overwritten elements are
//         never read again; inside a loop that passes values on, no other dimension folds.
// Not folded automatically: the innermost dimension of vectorized code, whose vectors would be split at the wrap.
// Source: the scheduling model of Ragan-Kelley et al., PLDI 2013, section 4.3.
// Tests: test/unit/lower/sliding_window_test.cpp.
#pragma once

#include <vector>

#include "lower/storage/sliding_window.h"

namespace retrograde::lower {

// A loop between computation and storage, with the box that one iteration of it accesses.
struct FoldingLoop {
  Loop loop;
  Box window;
};

struct Fold {
  Expr factor;  // undefined: the dimension does not fold
  Expr
      touched;  // number of coordinates accessed in one iteration, if not proven to be at most the factor
};

// One for each dimension. `loops`: innermost first.
std::vector<Fold> folds_of(const LoopedFunc& f, const std::vector<FoldingLoop>& loops,
                           const std::vector<Slide>& slides, const std::vector<Loop>& around,
                           bool is_vectorized);

}  // namespace retrograde::lower
