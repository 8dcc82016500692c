// random_gpu_schedule.h -- random schedules for GPUs.
//
// They have kernels of one to three dimensions, tiles in shared memory computed by the threads of a block, updates
// split into partial results or made atomic, and host stages between them.
#pragma once

#include "testing/programs/program.h"

namespace retrograde::fuzz {

// How often a schedule uses each feature.
using GpuScheduleCounts = std::map<std::string, uint64_t>;

// Schedules the program's Funcs. The compiler may refuse the result: a Func may be computed where not all of its
// consumers are.
GpuScheduleCounts schedule_on_gpu(const RandomProgram& program, Choices& choices);

}  // namespace retrograde::fuzz
