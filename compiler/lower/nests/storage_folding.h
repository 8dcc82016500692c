// storage_folding -- which dimensions of a Func's storage may wrap around.
//
//   f stored outside of the loop over y, each iteration of which touches rows y - 1 .. y + 1 of it:
//
//   realize f [0, w], [-1, h + 2]      =>      storage of w * 4 elements; row y lies at y & 3
//
// Method: loops between computation and storage from the outermost inwards; a dimension of which
//         one iteration touches no more than a constant number of coordinates folds to the next
//         power of two. Values that iterations hand on to the next must move one way, so that what
//         is overwritten is never read again; inside a loop that hands values on nothing else
//         folds.
// Not done on its own: the innermost dimension of vectorized code, whose vectors would tear.
// Source: the scheduling model of Ragan-Kelley et al., PLDI 2013, section 4.3.
// Tests: test/unit/sliding_window_test.cpp.
#pragma once

#include <vector>

#include "lower/nests/sliding_window.h"

namespace retrograde::lower {

// A loop between computation and storage, with what one iteration of it touches.
struct FoldingLoop {
  Loop loop;
  Box window;
};

struct Fold {
  Expr factor;   // undefined: the dimension does not fold
  Expr touched;  // by one iteration, where it is not proven to be at most the factor
};

// One for each dimension. `loops`: innermost first.
std::vector<Fold> folds_of(const LoopedFunc& f, const std::vector<FoldingLoop>& loops,
                           const std::vector<Slide>& slides, const std::vector<Loop>& around,
                           bool is_vectorized);

}  // namespace retrograde::lower
