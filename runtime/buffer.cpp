// What generated code does to shapes of buffers beyond plain stores.
#include <HalideRuntime.h>

#include "retrograde_runtime.h"

int32_t retrograde_buffer_device_dirty(retrograde_context*, const halide_buffer_t* buffer) {
  return buffer->device_dirty() ? 1 : 0;
}

int32_t retrograde_buffer_set_stride(retrograde_context*, halide_buffer_t* buffer,
                                     int32_t dimension, int32_t stride) {
  buffer->dim[dimension].stride = stride;
  return retrograde_error_success;
}
