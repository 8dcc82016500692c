// The device functions of HalideRuntime.h. They forward to the buffer's device interface; for a buffer that is not on a
// device yet, to the interface passed by the caller. CUDA's interface is in gpu/.
#include "gpu/gpu_calls.h"
#include "gpu/host.h"
#include "gpu/request.h"
#include "halide/call_context.h"
#include "halide/weak.h"

namespace {

namespace rt = retrograde::runtime;

int no_interface(void* user_context, const char* asked) {
  rt::CallContext caller(user_context);
  return rt::Request(caller, halide_error_code_no_device_interface, asked)
      .refuse("a device interface must be named", "it is null, and the buffer has none",
              "Pass halide_cuda_device_interface()");
}

int null_buffer(void* user_context, const char* asked) {
  rt::CallContext caller(user_context);
  return rt::Request(caller, halide_error_code_buffer_is_null, asked).refuse_null_buffer();
}

// The interface of a buffer that is on a device. Null if there is nothing to do or on an error; `code` tells which.
const halide_device_interface_t* interface_of(void* user_context, const halide_buffer_t* buffer,
                                              const char* asked, int& code) {
  code = buffer ? 0 : null_buffer(user_context, asked);
  if (!buffer || buffer->device_interface) return buffer ? buffer->device_interface : nullptr;
  if (buffer->device != 0 || buffer->device_dirty()) code = no_interface(user_context, asked);
  return nullptr;
}

// Pools of interfaces that keep memory; halide_register_device_allocation_pool adds to them.
halide_device_allocation_pool* pools = nullptr;

int release_pools(void* user_context) {
  rt::CallContext caller(user_context);
  int first = retrograde_gpu_release_unused(caller);
  for (auto* pool = __atomic_load_n(&pools, __ATOMIC_ACQUIRE); pool; pool = pool->next) {
    const int code = pool->release_unused(user_context);
    if (first == 0) first = code;
  }
  return first;
}

}  // namespace

RETROGRADE_WEAK int halide_copy_to_host(void* user_context, halide_buffer_t* buffer) {
  int code = 0;
  const auto* interface = interface_of(user_context, buffer, "copy a buffer to the host", code);
  return interface ? interface->copy_to_host(user_context, buffer) : code;
}

RETROGRADE_WEAK int halide_copy_to_device(void* user_context, halide_buffer_t* buffer,
                                          const halide_device_interface_t* interface) {
  if (!buffer) return null_buffer(user_context, "copy a buffer to a device");
  if (!interface) interface = buffer->device_interface;
  if (!interface) return no_interface(user_context, "copy a buffer to a device");
  return interface->copy_to_device(user_context, buffer, interface);
}

RETROGRADE_WEAK int halide_device_malloc(void* user_context, halide_buffer_t* buffer,
                                         const halide_device_interface_t* interface) {
  if (!interface) return no_interface(user_context, "allocate device memory");
  return interface->device_malloc(user_context, buffer, interface);
}

RETROGRADE_WEAK int halide_device_free(void* user_context, halide_buffer_t* buffer) {
  int code = 0;
  const auto* interface = interface_of(user_context, buffer, "free device memory", code);
  return interface ? interface->device_free(user_context, buffer) : code;
}

RETROGRADE_WEAK int halide_device_sync(void* user_context, halide_buffer_t* buffer) {
  int code = 0;
  const auto* interface = interface_of(user_context, buffer, "wait for a device", code);
  return interface ? interface->device_sync(user_context, buffer) : code;
}

RETROGRADE_WEAK void halide_device_release(void* user_context,
                                           const halide_device_interface_t* interface) {
  if (interface) interface->device_release(user_context, interface);
}

// ---- views of device memory, and the program's own memory ----

RETROGRADE_WEAK int halide_device_crop(void* user_context, const halide_buffer_t* src,
                                       halide_buffer_t* dst) {
  int code = 0;
  const auto* interface = interface_of(user_context, src, "crop device memory", code);
  return interface ? interface->device_crop(user_context, src, dst) : code;
}

RETROGRADE_WEAK int halide_device_slice(void* user_context, const halide_buffer_t* src,
                                        int slice_dim, int slice_pos, halide_buffer_t* dst) {
  int code = 0;
  const auto* interface = interface_of(user_context, src, "slice device memory", code);
  return interface ? interface->device_slice(user_context, src, slice_dim, slice_pos, dst) : code;
}

RETROGRADE_WEAK int halide_device_release_crop(void* user_context, halide_buffer_t* buffer) {
  int code = 0;
  const auto* interface = interface_of(user_context, buffer, "release a view", code);
  return interface ? interface->device_release_crop(user_context, buffer) : code;
}

RETROGRADE_WEAK int halide_device_wrap_native(void* user_context, halide_buffer_t* buffer,
                                              uint64_t handle,
                                              const halide_device_interface_t* interface) {
  if (!interface) return no_interface(user_context, "wrap device memory");
  return interface->wrap_native(user_context, buffer, handle, interface);
}

RETROGRADE_WEAK int halide_device_detach_native(void* user_context, halide_buffer_t* buffer) {
  int code = 0;
  const auto* interface = interface_of(user_context, buffer, "detach device memory", code);
  return interface ? interface->detach_native(user_context, buffer) : code;
}

// CUDA's interface also copies within the host.
RETROGRADE_WEAK int halide_buffer_copy(void* user_context, halide_buffer_t* src,
                                       const halide_device_interface_t* interface,
                                       halide_buffer_t* dst) {
  const auto* known = interface                        ? interface
                      : src && src->device_dirty()     ? src->device_interface
                                                       : nullptr;
  if (!known) known = retrograde_gpu_interface();
  return known->buffer_copy(user_context, src, interface, dst);
}

// ---- settings ----

RETROGRADE_WEAK int halide_reuse_device_allocations(void* user_context, bool reuse) {
  rt::set_reuses_device_memory(reuse);
  return reuse ? 0 : release_pools(user_context);
}

RETROGRADE_WEAK bool halide_can_reuse_device_allocations(void*) {
  return rt::reuses_device_memory();
}

RETROGRADE_WEAK void halide_register_device_allocation_pool(halide_device_allocation_pool* pool) {
  pool->next = __atomic_load_n(&pools, __ATOMIC_ACQUIRE);
  while (!__atomic_compare_exchange_n(&pools, &pool->next, pool, true, __ATOMIC_ACQ_REL,
                                      __ATOMIC_ACQUIRE)) {
  }
}

RETROGRADE_WEAK void halide_set_gpu_device(int number) { rt::choose_device(number); }
RETROGRADE_WEAK int halide_get_gpu_device(void*) { return rt::chosen_device(); }
