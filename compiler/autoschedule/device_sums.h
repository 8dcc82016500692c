// device_sums.h -- long sums to few elements, in as many partial sums as keep a device busy.
//
//   loss() += e(r.x, r.y)     =>    parts(u) += e of every 4096th point of the domain, from u on
//                                   sums(v) += parts of every 128th, from v on
//                                   loss() += sums(v)
//
// Partial sums are the threads of a kernel: neighbours read neighbours, unless the order of terms matters,
// as that of an argmin does among equals: then each has a stretch of them. Their number depends on the
// program and its sizes alone, and so does every bit. So it is for sums at places that data decide, where
// each part has few elements beside what is added to them. Loops whose extents are known are cut as one; of
// others, points of rows and rows apart.
#pragma once

#include <vector>

#include "autoschedule/default_schedule.h"
#include "autoschedule/size_estimate.h"
#include "autoschedule/stage_loops.h"
#include "graph/function.h"

namespace retrograde::autoschedule {

// Of the updates of these Funcs, all computed at root. The result: the Funcs that it makes, at root too.
std::vector<FuncPtr> cut_sums_for_device(const std::vector<FuncPtr>& funcs,
                                         const std::vector<FuncPtr>& stored,
                                         const ScheduleRequest& request, const SizeEstimate& sizes);

// Whether data, or the loops of a reduction, choose elements in which iterations may meet.
bool iterations_may_meet(const FuncContents& f, int stage, const std::vector<StageLoop>& loops);
// Whether these may be atomic updates of a device: bits are the same in any order, or may differ.
bool may_be_atomic(const FuncContents& f, int stage, const ScheduleRequest& request);

}  // namespace retrograde::autoschedule
