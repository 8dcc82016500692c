// The default host of devices: handlers come with a call's context, and libraries from the system.
#include "gpu/host.h"

#include <dlfcn.h>

#include <atomic>

namespace retrograde::runtime {
namespace {

void begin_call(retrograde_context* context, void* user_context) {
  *context = {};
  context->user_data = user_context;
}

void* load_library(const char* name) { return dlopen(name, RTLD_LAZY); }
void* library_symbol(void* library, const char* name) { return dlsym(library, name); }
bool may_reuse(retrograde_context*) { return reuses_device_memory(); }
int selected_device(retrograde_context*) { return chosen_device(); }

constexpr Host default_host = {begin_call, load_library, library_symbol, may_reuse,
                               selected_device};
std::atomic<const Host*> current{&default_host};

}  // namespace

const Host& host() { return *current.load(std::memory_order_acquire); }
void set_host(const Host& host) { current.store(&host, std::memory_order_release); }

}  // namespace retrograde::runtime
