// The functions through which devices ask the program for settings, libraries and contexts. The compiler's library uses
// the defaults of host.cpp. The static runtime sets functions that a program can replace through HalideRuntime.h
// (halide/host.cpp).
#pragma once

#include "retrograde_runtime.h"

namespace retrograde::runtime {

struct Host {
  // Makes the context of a call that has only a user context.
  void (*begin_call)(retrograde_context*, void* user_context);
  void* (*load_library)(const char* name);
  void* (*library_symbol)(void* library, const char* name);
  // Whether released device memory may be kept for reuse.
  bool (*may_reuse)(retrograde_context*);
  // The number of the selected device; -1 if none is selected.
  int (*selected_device)(retrograde_context*);
};

// Hidden, because each library that contains the static runtime has functions of its own.
#define RETROGRADE_HIDDEN __attribute__((visibility("hidden")))
RETROGRADE_HIDDEN const Host& host();
// `host` must live as long as the process or library.
RETROGRADE_HIDDEN void set_host(const Host& host);
#undef RETROGRADE_HIDDEN

// Defaults of the last two: process-wide settings, and HL_GPU_DEVICE.
bool reuses_device_memory();
void set_reuses_device_memory(bool);
int chosen_device();
void choose_device(int);

}  // namespace retrograde::runtime
