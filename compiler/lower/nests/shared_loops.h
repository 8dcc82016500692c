// shared_loops -- the code of two stages inside of loops that they share.
//
//   for y in [0, 8): f(y)                   for y in [0, 9):
//   for y in [2, 9): g(y)            =>       if (y <= 7) f(y)
//   g.compute_with(f, y)                      if (y >= 2) g(y)
//
// The loops run over the hull of both ranges, after those of one stage were shifted; where a range
// is provably all of it, there is no condition. Conditions are likely, so that partition_loops
// takes them out of what both share.
//
// What is needed stays apart for each stage: further out a stage needs what it would need alone,
// not what its loops would read in iterations that are only the other's. Only a Func that is
// computed inside of the shared loops must know what all stages need of it in one iteration: where
// conditions choose who runs, they choose the box, too.
// Tests: test/unit/compute_with_test.cpp.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "lower/nests/compute_place.h"
#include "lower/nests/emitted.h"

namespace retrograde::lower {

// Loops around a statement, innermost first; what is known of the names in their ranges.
struct SharedLoops {
  std::vector<Loop>& loops;
  ComputePlace& home;
};

// Runs `other` after `code` in the `depth` outermost of the loops, which grow to cover those of
// `other`. A loop variable of `other` is that of the loop plus its shift (outermost first).
void join(Emitted& code, SharedLoops around, Emitted other, const std::vector<Loop>& other_loops,
          const std::vector<Expr>& shift, int depth);

// Takes what the strands need of some Funcs into the needs of `code` itself, in terms of the loops
// from `inner` outwards. `keeps_moving`: of Funcs whose region should not jump when a stage begins
// or ends to run.
void gather_uses(Emitted& code, SharedLoops around, size_t inner,
                 const std::vector<std::string>& names,
                 const std::function<bool(const std::string&)>& keeps_moving);
// The same of their boxes of storage, or of what is read beside what they need.
void gather_boxes(Emitted& code, SharedLoops around, size_t inner,
                  std::map<std::string, Box> Needs::*boxes,
                  const std::function<bool(const std::string&)>& is_wanted);

// No loops are shared any more.
void merge_strands(Emitted& code);

}  // namespace retrograde::lower
