// What differs between the runtime inside of the compiler's library (gpu/library_host.cpp) and the
// static one (halide/cuda.cpp), whose answers programs replace by functions of HalideRuntime.h.
#pragma once

#include "retrograde_runtime.h"

namespace retrograde::runtime {

// The context of a call that came with a user context.
void begin_device_call(retrograde_context*, void* user_context);
void* load_library(const char* name);
void* library_symbol(void* library, const char* name);
// Whether device memory that is released may be kept.
bool may_reuse(retrograde_context*);
// The number of the wanted device; -1: nothing is said.
int wanted_device(retrograde_context*);

// What stands behind the last two by default: settings of the process, and HL_GPU_DEVICE.
bool reuses_device_memory();
void set_reuses_device_memory(bool);
int chosen_device();
void choose_device(int);

}  // namespace retrograde::runtime
