// work.h -- how long a stage computes, if all its data are in the first cache.
#pragma once

#include "autoschedule/cost/group.h"

namespace retrograde::planning {

// Nanoseconds of one thread that each kind of unit of a core is busy. They work at the same time.
struct UnitTimes {
  double arithmetic = 0, loads = 0, stores = 0, scalars = 0;
  double loops = 0;    // counts iterations
  double chain = 0;    // operations of which each waits for the one before
  double all() const;  // with what they cannot overlap
};

// Of all iterations of the stage, on one thread.
UnitTimes work_of(const StageRun& run, const Group& group, const Machine& machine);

}  // namespace retrograde::planning
