// The profiler's table for one pipeline: time, threads and peak memory by Func.
#pragma once

#include "profile.h"

namespace retrograde::runtime::profile {

std::string report_of(const Pipeline&);

}  // namespace retrograde::runtime::profile
