// split_history.h -- the loops of a schedule, which splits, fusions and renamings made, as steps of iterators.
//
//   split(x, x, xi, 32), split(xi, xi, xv, 16), reorder(xv, xi, y, x)     =>     x:32, y, x:16, x
//   split(x, x, xi, 16), split(x, xo, x, 4)                               =>     x:4*16, x:16, x
//   fuse(x, y, t), split(t, t, ti, 8)                                     =>     (x y):8, (x y)
#pragma once

#include <vector>

#include "autoschedule/plan/plan.h"

namespace retrograde::planning {

// The loops and fusions of a stage; `why` tells what a nest cannot express, and the nest is then empty.
struct History {
  Nest nest;
  Opacity why = Opacity::None;
};
History history_of(const graph::FuncContents& f, int stage);

}  // namespace retrograde::planning
