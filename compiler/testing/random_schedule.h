// Random legal schedules: where each Func is computed and stored, how, and the loops of each of its
// stages.
#pragma once

#include "testing/random_pipeline.h"
#include "testing/schedule_spec.h"

namespace retrograde::fuzz {

// Everything inlined that may be, nothing else said.
ScheduleSpec default_schedule(const PipelineSpec& pipeline);
ScheduleSpec random_schedule(const PipelineSpec& pipeline, uint64_t seed);

}  // namespace retrograde::fuzz
