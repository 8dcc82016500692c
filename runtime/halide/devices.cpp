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
