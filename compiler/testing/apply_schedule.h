// Gives a schedule to the Funcs of a pipeline.
#pragma once

#include "testing/build_pipeline.h"
#include "testing/schedule_spec.h"

namespace retrograde::fuzz {

// Derived Funcs are appended to built.funcs. UserError when a directive is refused.
void apply(const ScheduleSpec& schedule, BuiltPipeline& built);

}  // namespace retrograde::fuzz
