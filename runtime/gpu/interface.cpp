// The device interface of CUDA: buffers point to it, and the functions of HalideRuntime.h call it. The functions for
// buffers that generated code calls are the same with another context.
#include <HalideRuntime.h>

#include "gpu/buffer_copies.h"
#include "gpu/buffers.h"
#include "gpu/gpu_calls.h"
#include "gpu/host.h"
#include "gpu/views.h"

namespace retrograde::runtime {
namespace {

// The context of a call that has only a user context.
struct CallerOf {
  explicit CallerOf(void* user_context) { host().begin_call(&context, user_context); }
  operator retrograde_context*() { return &context; }
  retrograde_context context;
};

BufferCaller for_buffers(retrograde_context* context) {
  return {context, retrograde_gpu_interface()};
}

int device_malloc(void* user_context, halide_buffer_t* buffer, const halide_device_interface_t*) {
  CallerOf caller(user_context);
  return retrograde_gpu_malloc(caller, buffer);
}

int device_free(void* user_context, halide_buffer_t* buffer) {
  CallerOf caller(user_context);
  return retrograde_gpu_free(caller, buffer);
}

int device_sync(void* user_context, halide_buffer_t* buffer) {
  CallerOf caller(user_context);
  return retrograde_gpu_sync(caller, buffer);
}

void device_release(void* user_context, const halide_device_interface_t*) {
  CallerOf caller(user_context);
  retrograde_gpu_release(caller);
}

int copy_to_host(void* user_context, halide_buffer_t* buffer) {
  CallerOf caller(user_context);
  return retrograde_gpu_copy_to_host(caller, buffer);
}

int copy_to_device(void* user_context, halide_buffer_t* buffer, const halide_device_interface_t*) {
  CallerOf caller(user_context);
  return retrograde_gpu_copy_to_device(caller, buffer);
}

// Allocates host and device memory with the same layout. The host memory comes from the caller's handlers.
int device_and_host_malloc(void* user_context, halide_buffer_t* buffer,
                           const halide_device_interface_t*) {
  CallerOf caller(user_context);
  if (const int code = retrograde_gpu_malloc(caller, buffer)) return code;
  const int64_t bytes = span_bytes(*buffer);
  void* host = retrograde_allocate(caller, bytes, 1);
  if (host) {
    buffer->host = static_cast<uint8_t*>(host) + origin_bytes(*buffer);
    return 0;
  }
  retrograde_gpu_free(caller, buffer);
  return retrograde_allocation_error(caller, "a buffer on device and host", bytes, 1);
}

int device_and_host_free(void* user_context, halide_buffer_t* buffer) {
  CallerOf caller(user_context);
  const int code = retrograde_gpu_free(caller, buffer);
  if (buffer && buffer->host) {
    retrograde_free(caller, buffer->host - origin_bytes(*buffer));
    buffer->host = nullptr;
    buffer->set_host_dirty(false);
  }
  return code;
}

int buffer_copy(void* user_context, halide_buffer_t* from,
                const halide_device_interface_t* to_device, halide_buffer_t* to) {
  CallerOf caller(user_context);
  return retrograde_gpu_buffer_copy(caller, from, to_device != nullptr, to);
}

int device_crop(void* user_context, const halide_buffer_t* whole, halide_buffer_t* view) {
  CallerOf caller(user_context);
  const BufferRequest request(for_buffers(caller), retrograde_error_device_crop_failed,
                              "crop device memory");
  return whole && view ? crop_device(request, *whole, *view) : request.refuse_null_buffer();
}

int device_slice(void* user_context, const halide_buffer_t* whole, int dimension, int position,
                 halide_buffer_t* view) {
  CallerOf caller(user_context);
  const BufferRequest request(for_buffers(caller), retrograde_error_device_crop_failed,
                              "slice device memory");
  return whole && view ? slice_device(request, *whole, dimension, position, *view)
                       : request.refuse_null_buffer();
}

int device_release_crop(void*, halide_buffer_t* buffer) {
  if (buffer) leave_device(*buffer);
  return 0;
}

int wrap_native(void* user_context, halide_buffer_t* buffer, uint64_t address,
                const halide_device_interface_t*) {
  CallerOf caller(user_context);
  const BufferRequest request(for_buffers(caller), retrograde_error_device_wrap_native_failed,
                              "wrap device memory");
  return buffer ? guarded(request, [&] { return wrap_memory(request, *buffer, address); })
                : request.refuse_null_buffer();
}

int detach_native(void* user_context, halide_buffer_t* buffer) {
  CallerOf caller(user_context);
  const Request request(caller, retrograde_error_device_detach_native_failed,
                        "detach device memory");
  return buffer ? guarded(request, [&] { return detach_memory(request, *buffer); })
                : request.refuse_null_buffer();
}

int compute_capability(void* user_context, int* major, int* minor) {
  CallerOf caller(user_context);
  const Request request(caller, retrograde_error_generic, "ask a device for its capability");
  Session session(request);
  int32_t code = session.open();
  if (code == 0) {
    const Driver& driver = session.driver();
    const int number = session.device().number;
    Result result = driver.cuDeviceGetAttribute(major, attribute_major, number);
    if (result == success) result = driver.cuDeviceGetAttribute(minor, attribute_minor, number);
    if (result != success) code = session.failed("cuDeviceGetAttribute", result);
  }
  return session.close(code);
}

}  // namespace
}  // namespace retrograde::runtime

namespace rt = retrograde::runtime;

const halide_device_interface_t* retrograde_gpu_interface(void) {
  using namespace retrograde::runtime;
  static constexpr halide_device_interface_t interface = {device_malloc,
                                                          device_free,
                                                          device_sync,
                                                          device_release,
                                                          copy_to_host,
                                                          copy_to_device,
                                                          device_and_host_malloc,
                                                          device_and_host_free,
                                                          buffer_copy,
                                                          device_crop,
                                                          device_slice,
                                                          device_release_crop,
                                                          wrap_native,
                                                          detach_native,
                                                          compute_capability,
                                                          nullptr};
  return &interface;
}

int32_t retrograde_gpu_malloc(retrograde_context* caller, halide_buffer_t* buffer) {
  return rt::allocate_device_memory(rt::for_buffers(caller), buffer);
}

int32_t retrograde_gpu_free(retrograde_context* caller, halide_buffer_t* buffer) {
  return rt::free_device_memory(rt::for_buffers(caller), buffer);
}

int32_t retrograde_gpu_copy_to_device(retrograde_context* caller, halide_buffer_t* buffer) {
  return rt::copy_newest(rt::for_buffers(caller), buffer, rt::Place::device);
}

int32_t retrograde_gpu_copy_to_host(retrograde_context* caller, halide_buffer_t* buffer) {
  return rt::copy_newest(rt::for_buffers(caller), buffer, rt::Place::host);
}

int32_t retrograde_gpu_sync(retrograde_context* caller, halide_buffer_t* buffer) {
  return rt::wait_for_stream(caller, buffer);
}

int32_t retrograde_gpu_buffer_copy(retrograde_context* caller, halide_buffer_t* from,
                                   int32_t to_device, halide_buffer_t* to) {
  const rt::Place place = to_device ? rt::Place::device : rt::Place::host;
  return rt::copy_buffer(rt::for_buffers(caller), from, to, place);
}
