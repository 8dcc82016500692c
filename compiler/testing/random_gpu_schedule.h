// Random schedules for GPUs: kernels of one to three dimensions, tiles in shared memory computed by the
// threads of a block, updates cut into partial results or made atomic, stages of the host between them.
#pragma once

#include "testing/programs/program.h"

namespace retrograde::fuzz {

// How often a schedule has each of what it may have.
using GpuScheduleCounts = std::map<std::string, uint64_t>;

// Schedules the program's Funcs. What the compiler refuses of it, it says: a Func may be computed where
// not all of its users are.
GpuScheduleCounts schedule_on_gpu(const RandomProgram& program, Choices& choices);

}  // namespace retrograde::fuzz
