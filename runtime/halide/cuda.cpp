// The functions of HalideRuntimeCuda.h for memory and kernels.
#include <HalideRuntimeCuda.h>

#include "gpu/gpu_calls.h"
#include "halide/call_context.h"
#include "halide/weak.h"

using retrograde::runtime::CallContext;

RETROGRADE_WEAK const halide_device_interface_t* halide_cuda_device_interface() {
  return retrograde_gpu_interface();
}

// ---- memory ----

RETROGRADE_WEAK int halide_cuda_wrap_device_ptr(void* user_context, halide_buffer_t* buffer,
                                                uint64_t address) {
  const auto* interface = halide_cuda_device_interface();
  return interface->wrap_native(user_context, buffer, address, interface);
}
RETROGRADE_WEAK int halide_cuda_detach_device_ptr(void* user_context, halide_buffer_t* buffer) {
  return halide_cuda_device_interface()->detach_native(user_context, buffer);
}
RETROGRADE_WEAK uintptr_t halide_cuda_get_device_ptr(void*, halide_buffer_t* buffer) {
  return buffer ? buffer->device : 0;
}
RETROGRADE_WEAK int halide_cuda_release_unused_device_allocations(void* user_context) {
  CallContext caller(user_context);
  return retrograde_gpu_release_unused(caller);
}

// ---- kernels ----

RETROGRADE_WEAK int halide_cuda_initialize_kernels(void* user_context, void** state,
                                                   const char* source, int bytes) {
  CallContext caller(user_context);
  return retrograde_gpu_initialize_kernels(caller, state, source, bytes);
}

RETROGRADE_WEAK int halide_cuda_run(void* user_context, void* state, const char* name, int blocks_x,
                                    int blocks_y, int blocks_z, int threads_x, int threads_y,
                                    int threads_z, int shared_bytes, size_t arg_sizes[],
                                    void* args[], int8_t arg_is_buffer[]) {
  CallContext caller(user_context);
  return retrograde_gpu_run(caller, state, name, blocks_x, blocks_y, blocks_z, threads_x, threads_y,
                            threads_z, shared_bytes, arg_sizes, args, arg_is_buffer);
}

RETROGRADE_WEAK void halide_cuda_finalize_kernels(void* user_context, void* state) {
  CallContext caller(user_context);
  retrograde_gpu_finalize_kernels(caller, state);
}
