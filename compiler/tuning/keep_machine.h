// keep_machine.h -- the measured figures of this processor, written to the user's cache folder, where
// autoschedule/machine/kept_machine.h finds them.
#pragma once

#include <string>

#include "autoschedule/machine/machine.h"

namespace retrograde::tuning {

// Keeps it for this processor, whole or not at all; gives the file's path.
// Requires: the cache folder can be written.
std::string keep_machine(const planning::Machine& machine);

}  // namespace retrograde::tuning
