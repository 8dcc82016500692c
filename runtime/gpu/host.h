// Differences between the runtime in the compiler's library (gpu/library_host.cpp) and the static runtime
// (halide/cuda.cpp), whose functions programs can replace through HalideRuntime.h.
#pragma once

#include "retrograde_runtime.h"

namespace retrograde::runtime {

// Makes the context of a call that has only a user context.
void begin_device_call(retrograde_context*, void* user_context);
void* load_library(const char* name);
void* library_symbol(void* library, const char* name);
// Whether released device memory may be kept for reuse.
bool may_reuse(retrograde_context*);
// The number of the selected device; -1 if none is selected.
int wanted_device(retrograde_context*);

// Defaults of the last two: process-wide settings, and HL_GPU_DEVICE.
bool reuses_device_memory();
void set_reuses_device_memory(bool);
int chosen_device();
void choose_device(int);

}  // namespace retrograde::runtime
