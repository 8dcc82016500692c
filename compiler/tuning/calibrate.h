// calibrate.h -- measures the figures of this machine by compiling and running small pipelines.
#pragma once

#include "autoschedule/machine/machine.h"
#include "ir/target.h"

namespace retrograde::tuning {

// Takes a few seconds, and all threads; on a machine that does something else, too, the figures are
// those of what it has left.
planning::Machine calibrate(const Target& target);

}  // namespace retrograde::tuning
