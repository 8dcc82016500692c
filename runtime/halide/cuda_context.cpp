// The CUDA context and stream of calls through HalideRuntime.h. A program selects them by setting a handler, or by
// defining a function with the handler's name.
#include "halide/cuda_context.h"

#include <HalideRuntimeCuda.h>

#include <atomic>

#include "gpu/gpu_calls.h"
#include "gpu/session.h"
#include "halide/handlers.h"
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

}  // namespace retrograde::runtime

namespace rt = retrograde::runtime;

RETROGRADE_WEAK int halide_cuda_acquire_context(void* user_context, void** context, bool create) {
  if (const auto handler = rt::acquire_handler.load())
    return handler(user_context, context, create);
  retrograde_context caller = rt::reporting_context(user_context);
  const rt::Request request(&caller, halide_error_code_generic_error, "find a device");
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
