// covers.h -- the points of its iterators that a stage of a plan covers while some of its loops run, and the boxes of Funcs
// that are computed in loops.
//
//   out  root  y:8, x:16, y, x       out(x, y) = blur(x - 1, y) + blur(x + 1, y)
//   blur  at out/x:16
//
// One iteration of out/x:16 covers 16 by 8 points of out and needs a box of 18 by 8 elements of blur. So all loops of blur
// together cover 18 by 8 points.
#pragma once

#include <map>
#include <optional>
#include <vector>

#include "autoschedule/access/cover.h"
#include "autoschedule/plan/plan.h"

namespace retrograde::planning {

class Covers {
 public:
  // Both are referred to. Requires: the sizes are those of the plan's program.
  Covers(const Plan& plan, const SizeModel& sizes) : plan_(plan), sizes_(sizes) {}

  // The points that one iteration of the loop at this depth covers. `around_all_loops`: those of all loops, which are all
  // points that are computed at once at the place of the Func. Loops of an opaque stage cover all of it each.
  Cover inside(StageId stage, int depth);
  // By dimension, the extents of the box of a Func that one iteration of the level's loop needs, also through other
  // Funcs inside of the loop, and through updates of the Func itself. Requires: a stage inside of the loop reads it.
  std::vector<int64_t> box(FuncId func, const Level& level);

 private:
  using Key = std::tuple<FuncId, StageId, int16_t, bool>;
  const Plan& plan_;
  const SizeModel& sizes_;
  std::map<Key, std::vector<int64_t>> boxes_;

  Cover all_of(StageId stage);
  Cover cover_in(StageId stage, const Level& level);
};

// Requires: as above. Many questions about one plan are cheaper to one `Covers`.
inline Cover cover_inside(const Plan& plan, StageId stage, int depth, const SizeModel& sizes) {
  return Covers(plan, sizes).inside(stage, depth);
}

}  // namespace retrograde::planning
