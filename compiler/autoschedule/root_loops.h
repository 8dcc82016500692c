// root_loops.h -- the loops of one stage that is computed at root: which tiles, which vectors, which
// tasks. A stage that reads across rows runs in squares; a sum keeps a tile of its elements in
// registers (register_tile.h), beside copies of what such a tile reads; a scan of rows goes in blocks of
// columns; all others in vectors along their first dimension.
#pragma once

#include "autoschedule/machine/reference.h"
#include "autoschedule/register_tile.h"
#include "autoschedule/schedule_request.h"
#include "autoschedule/size_estimate.h"
#include "graph/function.h"

namespace retrograde::autoschedule {

using planning::schedule_lanes;

void give_root_loops(const FuncPtr& f, int stage, const ScheduleRequest& request,
                     const SizeEstimate& sizes);
// Of one tile, in the loops of another Func over all of them.
void give_loops_of_tile(const FuncPtr& f, int stage, const RegisterTile& tile,
                        const ScheduleRequest& request, const SizeEstimate& sizes);
// Of a pure Func: rows, in memory too, along another dimension than the first.
void give_loops_along(const FuncPtr& f, size_t dimension, const ScheduleRequest& request,
                      const SizeEstimate& sizes);

}  // namespace retrograde::autoschedule
