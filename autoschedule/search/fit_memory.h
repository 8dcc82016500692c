// fit_memory.h -- from a plan that allocates too many bytes at once to one that keeps within a limit, or comes nearer.
//
//   weight    root   480 MB       =>     weight    inline             distance  root   480 MB
//   distance  root   480 MB
//
// One Func after the other leaves memory: it is computed in the loops of those that read it, or inlined. Each time it is
// the one with the fewest seconds for a byte, where bytes below the limit are worth nothing. One that is in no memory may
// also be stored, if that lets others go.
#pragma once

#include "autoschedule/search/search.h"

namespace retrograde::planning {

// Gives up where each further plan takes more than `most_seconds`. Uses the limit of bytes and the Funcs that stay from the
// options.
FoundPlan fit_memory(FoundPlan found, const Context& context, CostModel& cost,
                     const SearchOptions& options, double most_seconds);

}  // namespace retrograde::planning
