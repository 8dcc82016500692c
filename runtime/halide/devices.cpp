// The device functions of HalideRuntime.h in a runtime without devices: nothing is ever on one,
// so there is nothing to copy or free; a buffer that says otherwise is an error.
#include "halide/weak.h"
#include "retrograde_runtime.h"

namespace {

int no_device(void* user_context, const char* asked) {
  char message[512];
  retrograde_format_message(message, sizeof message,
                            "cannot %s: the buffer must be in host memory; this runtime has no "
                            "devices. Copy it to the host first",
                            asked);
  halide_error(user_context, message);
  return halide_error_code_no_device_interface;
}

}  // namespace

RETROGRADE_WEAK int halide_copy_to_host(void* user_context, halide_buffer_t* buffer) {
  return buffer->device_dirty() ? no_device(user_context, "copy a buffer to the host") : 0;
}
RETROGRADE_WEAK int halide_copy_to_device(void* user_context, halide_buffer_t*,
                                          const halide_device_interface_t*) {
  return no_device(user_context, "copy a buffer to a device");
}
RETROGRADE_WEAK int halide_device_malloc(void* user_context, halide_buffer_t*,
                                         const halide_device_interface_t*) {
  return no_device(user_context, "allocate on a device");
}
RETROGRADE_WEAK int halide_device_free(void* user_context, halide_buffer_t* buffer) {
  return buffer->device ? no_device(user_context, "free device memory") : 0;
}
RETROGRADE_WEAK int halide_device_sync(void* user_context, halide_buffer_t* buffer) {
  return buffer && buffer->device ? no_device(user_context, "wait for a device") : 0;
}
RETROGRADE_WEAK void halide_device_release(void*, const halide_device_interface_t*) {}

// ---- what a device would offer: views of its memory, and memory that it keeps ----

RETROGRADE_WEAK int halide_device_crop(void* user_context, const halide_buffer_t* src,
                                       halide_buffer_t*) {
  return src && src->device ? no_device(user_context, "crop device memory") : 0;
}
RETROGRADE_WEAK int halide_device_slice(void* user_context, const halide_buffer_t* src, int, int,
                                        halide_buffer_t*) {
  return src && src->device ? no_device(user_context, "slice device memory") : 0;
}
RETROGRADE_WEAK int halide_device_release_crop(void* user_context, halide_buffer_t* buffer) {
  return buffer && buffer->device ? no_device(user_context, "release a view of device memory") : 0;
}
RETROGRADE_WEAK int halide_device_wrap_native(void* user_context, halide_buffer_t*, uint64_t,
                                              const halide_device_interface_t*) {
  return no_device(user_context, "wrap device memory");
}
RETROGRADE_WEAK int halide_device_detach_native(void* user_context, halide_buffer_t* buffer) {
  return buffer && buffer->device ? no_device(user_context, "detach device memory") : 0;
}
// Nothing is ever kept, whatever is allowed.
RETROGRADE_WEAK int halide_reuse_device_allocations(void*, bool) { return 0; }
RETROGRADE_WEAK bool halide_can_reuse_device_allocations(void*) { return false; }
RETROGRADE_WEAK void halide_register_device_allocation_pool(halide_device_allocation_pool*) {}
RETROGRADE_WEAK void halide_set_gpu_device(int) {}
RETROGRADE_WEAK int halide_get_gpu_device(void*) { return -1; }
