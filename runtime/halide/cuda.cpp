// The functions of HalideRuntimeCuda.h, and the device handlers of calls through HalideRuntime.h. A program selects the
// context and stream by setting a handler, or by defining a function with the handler's name.
#include <HalideRuntimeCuda.h>

#include <atomic>

#include "gpu/gpu_calls.h"
#include "gpu/host.h"
#include "gpu/session.h"
#include "halide/gpu_handlers.h"
#include "halide/weak.h"

namespace retrograde::runtime {
namespace {

std::atomic<halide_cuda_acquire_context_t> acquire_handler{nullptr};
std::atomic<halide_cuda_release_context_t> release_handler{nullptr};
std::atomic<halide_cuda_get_stream_t> stream_handler{nullptr};

int32_t acquire(retrograde_context* context, void** cuda_context, int32_t create) {
  return halide_cuda_acquire_context(context->user_data, cuda_context, create != 0);
}
int32_t release(retrograde_context* context) {
  return halide_cuda_release_context(context->user_data);
}
int32_t get_stream(retrograde_context* context, void* cuda_context, void** stream) {
  return halide_cuda_get_stream(context->user_data, cuda_context, stream);
}

}  // namespace

const retrograde_gpu_handlers* halide_gpu_handlers() {
  static constexpr retrograde_gpu_handlers handlers = {acquire, release, get_stream};
  return &handlers;
}

void begin_device_call(retrograde_context* context, void* user_context) {
  retrograde_begin_call(context, user_context);
}

void* load_library(const char* name) { return halide_load_library(name); }
void* library_symbol(void* library, const char* name) {
  return halide_get_library_symbol(library, name);
}
bool may_reuse(retrograde_context* context) {
  return halide_can_reuse_device_allocations(context ? context->user_data : nullptr);
}
int wanted_device(retrograde_context* context) {
  return halide_get_gpu_device(context ? context->user_data : nullptr);
}

}  // namespace retrograde::runtime

namespace rt = retrograde::runtime;

namespace {

struct CallerOf {
  explicit CallerOf(void* user_context) { retrograde_begin_call(&context, user_context); }
  operator retrograde_context*() { return &context; }
  retrograde_context context;
};

}  // namespace

RETROGRADE_WEAK const halide_device_interface_t* halide_cuda_device_interface() {
  return retrograde_gpu_interface();
}

// ---- selecting context and stream ----

RETROGRADE_WEAK int halide_cuda_acquire_context(void* user_context, void** context, bool create) {
  if (const auto handler = rt::acquire_handler.load())
    return handler(user_context, context, create);
  CallerOf caller(user_context);
  const rt::Request request(caller, halide_error_code_generic_error, "find a device");
  const rt::Driver* driver = rt::open_driver(request);
  if (!driver) return request.code;
  rt::Context current = nullptr;
  if (const rt::Result result = driver->cuCtxGetCurrent(&current); result != rt::success)
    return request.driver_failed(*driver, "cuCtxGetCurrent", result);
  return rt::default_context(request, *driver, current, *context);
}

RETROGRADE_WEAK int halide_cuda_release_context(void* user_context) {
  const auto handler = rt::release_handler.load();
  return handler ? handler(user_context) : 0;
}

RETROGRADE_WEAK int halide_cuda_get_stream(void* user_context, void* context, void** stream) {
  if (const auto handler = rt::stream_handler.load()) return handler(user_context, context, stream);
  *stream = nullptr;
  return 0;
}

RETROGRADE_WEAK halide_cuda_acquire_context_t
halide_set_cuda_acquire_context(halide_cuda_acquire_context_t handler) {
  return rt::acquire_handler.exchange(handler);
}
RETROGRADE_WEAK halide_cuda_release_context_t
halide_set_cuda_release_context(halide_cuda_release_context_t handler) {
  return rt::release_handler.exchange(handler);
}
RETROGRADE_WEAK halide_cuda_get_stream_t
halide_set_cuda_get_stream(halide_cuda_get_stream_t handler) {
  return rt::stream_handler.exchange(handler);
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
  CallerOf caller(user_context);
  return retrograde_gpu_release_unused(caller);
}

// ---- kernels ----

RETROGRADE_WEAK int halide_cuda_initialize_kernels(void* user_context, void** state,
                                                   const char* source, int bytes) {
  CallerOf caller(user_context);
  return retrograde_gpu_initialize_kernels(caller, state, source, bytes);
}

RETROGRADE_WEAK int halide_cuda_run(void* user_context, void* state, const char* name, int blocks_x,
                                    int blocks_y, int blocks_z, int threads_x, int threads_y,
                                    int threads_z, int shared_bytes, size_t arg_sizes[],
                                    void* args[], int8_t arg_is_buffer[]) {
  CallerOf caller(user_context);
  return retrograde_gpu_run(caller, state, name, blocks_x, blocks_y, blocks_z, threads_x, threads_y,
                            threads_z, shared_bytes, arg_sizes, args, arg_is_buffer);
}

RETROGRADE_WEAK void halide_cuda_finalize_kernels(void* user_context, void* state) {
  CallerOf caller(user_context);
  retrograde_gpu_finalize_kernels(caller, state);
}
