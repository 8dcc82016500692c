// chosen_places.h -- which Funcs a user wants to be stored or inlined, by name.
#pragma once

#include <vector>

#include "frontend/schedule/autoschedule_options.h"
#include "graph/function.h"

namespace retrograde::driver {

// UserError where a name is none of the pipeline's, or a Func cannot be where it is wanted. Funcs with a directive keep
// theirs, whatever the options say.
void check_chosen_places(const std::vector<FuncPtr>& outputs, const AutoscheduleOptions& options);

}  // namespace retrograde::driver
