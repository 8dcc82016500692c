// gpu_schedule.h -- the loops of what is stored, as kernels: what Pipeline::auto_schedule gives where
// the target has a GPU.
//
//   a stage                                       its kernel
//   f(x, y, c) = e                                a block for 32 x 4 points, a thread for each
//   f(x, y) += e(x, y, r)                         the same; each thread runs over the domain
//   f(x, r) = f(x, r - 1) + e                     threads along x, each of which scans
//   f() += e(r), long, or to few elements         partial sums first: device_sums.h
//   f(i(r)) += 1, integers                        a thread for each iteration, atomic updates
//   f(i(r)) += e(r), floats                       one thread for what may meet, unless bits may differ
//   no loop whose iterations are independent      one thread
//
// Loops whose iterations are independent, of pure dimensions and of reductions, are the grid: threads
// along what lies together in memory. Up to three loops over blocks; more of them, and such as may be too
// long for a device, are one. Results have the same bits in each run, unless the options let them differ.
#pragma once

#include <unordered_set>
#include <vector>

#include "autoschedule/default_schedule.h"
#include "autoschedule/size_estimate.h"
#include "graph/function.h"

namespace retrograde::autoschedule {

struct HostStage {
  FuncPtr func;
  int stage = 0;
};
struct GpuSchedule {
  std::vector<HostStage> on_host;  // what no kernel can compute: its loops are still to be given
  SizeEstimate sizes;              // of all Funcs, those that it has made too
};

// Computes the stored Funcs that nobody scheduled at root, and gives all of their loops but those of
// `but`, which others name.
GpuSchedule schedule_on_gpu(const std::vector<FuncPtr>& outputs, const std::vector<FuncPtr>& stored,
                            const std::unordered_set<const Symbol*>& but,
                            const ScheduleRequest& request);

}  // namespace retrograde::autoschedule
