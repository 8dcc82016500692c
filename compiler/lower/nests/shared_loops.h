// shared_loops -- combine the code of two stages inside the loops that they share (compute_with).
//
//   for y in [0, 8): f(y)                   for y in [0, 9):
//   for y in [2, 9): g(y)            =>       if (y <= 7) f(y)
//   g.compute_with(f, y)                      if (y >= 2) g(y)
//
// The loops run over the hull of both ranges, after the loops of one stage are shifted. There is no condition for a
// stage whose range is provably the hull. Conditions are likely, so that partition_loops removes them from the
// iterations that both stages share.
//
// The needs of each stage stay separate: further out a stage needs the same as alone, without the iterations that
// belong only to the other stage. Only a Func that is computed inside of the shared loops must know the needs of all
// stages in one iteration: the conditions that choose which stage runs also choose the box.
// Tests: test/unit/lower/compute_with_test.cpp.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "lower/nests/compute_place.h"
#include "lower/nests/emitted.h"

namespace retrograde::lower {

// Loops around a statement, innermost first, and the place that knows the names in their ranges.
struct SharedLoops {
  std::vector<Loop>& loops;
  ComputePlace& home;
};

// Runs `other` after `code` in the `depth` outermost loops, which grow to cover those of `other`. A loop variable of
// `other` is that of the loop plus its shift; shifts are listed outermost first.
void join(Emitted& code, SharedLoops around, Emitted other, const std::vector<Loop>& other_loops,
          const std::vector<Expr>& shift, int depth);

// Moves the strands' uses of some Funcs into the needs of `code` itself, in terms of the loops from `inner` outwards.
// `keeps_moving`: selects Funcs whose region should not jump when a stage starts or stops running.
void gather_uses(Emitted& code, SharedLoops around, size_t inner,
                 const std::vector<std::string>& names,
                 const std::function<bool(const std::string&)>& keeps_moving);
// The same for boxes of storage, or for accesses beyond the required regions.
void gather_boxes(Emitted& code, SharedLoops around, size_t inner,
                  std::map<std::string, Box> Needs::*boxes,
                  const std::function<bool(const std::string&)>& is_wanted);

// Merges the strands once no loops are shared any more.
void merge_strands(Emitted& code);

}  // namespace retrograde::lower
