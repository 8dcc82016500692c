// default_schedule.h -- a sane schedule for Funcs that nobody scheduled: directives such as a user
// would give, each in its Func's log (graph/directives/schedule_log.h). Pipelines that contain adjoints get it
// whenever they are compiled, others when they ask for it (Pipeline::auto_schedule).
//
// Sums to one element are cut into lanes and rows (cut_reductions.h). What is stored
// (stored_funcs.h) is computed at root, its innermost dimension vectorized, its outermost run in
// parallel; a stage that reads across rows is tiled; a reduction keeps a tile of its sums in
// registers (register_tile.h); a scatter along its reduction domain computes places and terms in
// vectors. What one Func alone reads slice by slice moves into its loops (slices.h,
// reduction_slices.h).
#pragma once

#include <cstdint>
#include <vector>

#include "autoschedule/schedule_request.h"
#include "autoschedule/size_estimate.h"
#include "graph/function.h"

namespace retrograde::autoschedule {

// Of which Funcs of a graph: adjoints and what is computed with them, or all.
enum class Scheduling : uint8_t { Gradients, Everything };

// Gives the directives to the Funcs of this graph, whose wrappers have been applied. The result: how
// large these Funcs are; of those that the schedule makes, which are small, nothing is known.
SizeEstimate give_default_schedule(const std::vector<FuncPtr>& outputs,
                                   const ScheduleRequest& request, Scheduling what);

// The pass: the outputs with their wrappers applied, or, where there are adjoints, those of a copy
// of the graph that has its schedule. What lowering is given.
std::vector<FuncPtr> schedule_unscheduled(const std::vector<FuncPtr>& outputs,
                                          const planning::Machine& machine = {},
                                          const AutoscheduleOptions& options = {});

}  // namespace retrograde::autoschedule
