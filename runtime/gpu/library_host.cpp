// Device settings in the compiler's library: handlers come with a call's context; no function is replaced by its name.
#include <dlfcn.h>

#include "gpu/host.h"

namespace retrograde::runtime {

void begin_device_call(retrograde_context* context, void* user_context) {
  *context = {};
  context->user_data = user_context;
}

void* load_library(const char* name) { return dlopen(name, RTLD_LAZY); }
void* library_symbol(void* library, const char* name) { return dlsym(library, name); }
bool may_reuse(retrograde_context*) { return reuses_device_memory(); }
int wanted_device(retrograde_context*) { return chosen_device(); }

}  // namespace retrograde::runtime
