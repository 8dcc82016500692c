// kept_machine.h -- the measured description of this processor: a file that RETROGRADE_MACHINE names, or one in the
// user's cache folder, which `tune --machine` writes.
#pragma once

#include <string>

#include "autoschedule/machine/machine.h"

namespace retrograde::planning {

// The version of the figures. It increases when the meaning of a figure changes; older files are then ignored.
inline constexpr int figures_version = 1;

// The machine that the cost model uses: that of RETROGRADE_MACHINE, else the measured one for this processor, else the
// constants. A file in the cache folder that cannot be read counts as missing.
// Requires: RETROGRADE_MACHINE names a file with the description of a machine.
Machine machine_for(const Target& target);

// $XDG_CACHE_HOME/retrograde, else ~/.cache/retrograde; empty if there is neither.
std::string cache_folder();
// The name of the file in that folder that describes this processor.
std::string kept_file_name();
std::string processor_name();

}  // namespace retrograde::planning
