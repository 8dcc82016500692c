// nest_trips.h -- how often the loops of a nest run, and which iterators they move.
#pragma once

#include <vector>

#include "autoschedule/cost/touch.h"
#include "autoschedule/plan/plan.h"

namespace retrograde::planning {

struct NestTrips {
  std::vector<double> trips;       // by depth, of one run of the loops around it
  std::vector<IteratorSet> moves;  // by depth
  LaneLoop lanes;                  // of the loop over lanes, if there is one
};

// `extents`: the points of the stage's iterators that all loops together run over.
NestTrips nest_trips(const Nest& nest, const Cover& extents);

}  // namespace retrograde::planning
