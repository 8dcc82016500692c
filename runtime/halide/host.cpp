// Devices of the static runtime ask the functions of HalideRuntime.h, which the program can replace.
#include "gpu/host.h"

#include "halide/weak.h"

namespace retrograde::runtime {
namespace {

bool may_reuse(retrograde_context* context) {
  return halide_can_reuse_device_allocations(context ? context->user_data : nullptr);
}
int selected_device(retrograde_context* context) {
  return halide_get_gpu_device(context ? context->user_data : nullptr);
}
void* load_library(const char* name) { return halide_load_library(name); }
void* library_symbol(void* library, const char* name) {
  return halide_get_library_symbol(library, name);
}

constexpr Host halide_host = {retrograde_begin_call, load_library, library_symbol, may_reuse,
                              selected_device};

// 101 is the first priority for programs: this runs before constructors of global objects, which may use devices.
__attribute__((constructor(101))) void use_halide_host() { set_host(halide_host); }

}  // namespace
}  // namespace retrograde::runtime
