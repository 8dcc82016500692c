#include "gpu/kernel_storage.h"

#include <HalideRuntime.h>

#include <algorithm>
#include <cstdlib>
#include <new>

namespace {

// Marks a pipeline's internal storage, which is empty at first, unlike buffers passed by the caller.
constexpr uint64_t is_own_storage = uint64_t{1} << 32;
// Set between retrograde_overwrite_begin and retrograde_overwrite_end.
constexpr uint64_t is_overwritten = uint64_t{1} << 33;

struct OwnBuffer {
  halide_buffer_t buffer = {};
  halide_dimension_t dimension = {};
};

}  // namespace

halide_buffer_t* retrograde_device_buffer(retrograde_context* context, void* host, int64_t elements,
                                          uint32_t type) {
  auto* own = new (std::nothrow) OwnBuffer;
  if (!own) {
    retrograde_allocation_error(context, "a buffer on a device", 1, sizeof(OwnBuffer));
    return nullptr;
  }
  halide_buffer_t& buffer = own->buffer;
  buffer.host = static_cast<uint8_t*>(host);
  buffer.type =
      halide_type_t(static_cast<halide_type_code_t>(type & 0xff),
                    static_cast<uint8_t>((type >> 8) & 0xff), static_cast<uint16_t>(type >> 16));
  buffer.dimensions = 1;
  buffer.dim = &own->dimension;
  own->dimension = halide_dimension_t(0, static_cast<int32_t>(elements), 1);
  buffer.flags = is_own_storage;
  return &buffer;
}

int32_t retrograde_device_buffer_free(retrograde_context* context, halide_buffer_t* buffer) {
  if (!buffer) return 0;
  const int32_t code = buffer->device ? retrograde_gpu_free(context, buffer) : 0;
  delete reinterpret_cast<OwnBuffer*>(buffer);
  return code;
}

halide_buffer_t* retrograde_overwrite_begin(retrograde_context*, halide_buffer_t* buffer,
                                            int32_t num_others, halide_buffer_t* const* others) {
  if (std::find(others, others + num_others, buffer) != others + num_others) return nullptr;
  buffer->flags |= is_overwritten;
  return buffer;
}

int32_t retrograde_overwrite_end(retrograde_context*, halide_buffer_t* buffer) {
  if (buffer) buffer->flags &= ~is_overwritten;
  return 0;
}

// A buffer that only gets memory stays marked as host-dirty until a kernel that writes it has been launched: if the
// launch fails, the elements on the host are still valid.
int32_t retrograde_to_device(retrograde_context* context, halide_buffer_t* buffer) {
  const bool is_given = !(buffer->flags & is_own_storage);
  if (is_given && !buffer->device && buffer->host) buffer->set_host_dirty(true);
  if ((buffer->flags & is_overwritten) && !buffer->device_dirty())
    return retrograde_gpu_malloc(context, buffer);
  return retrograde_gpu_copy_to_device(context, buffer);
}

int32_t retrograde_device_changed(retrograde_context*, halide_buffer_t* buffer) {
  buffer->set_host_dirty(false);
  buffer->set_device_dirty(true);
  return 0;
}

int32_t retrograde_to_host(retrograde_context* context, halide_buffer_t* buffer) {
  return buffer->device_dirty() ? retrograde_gpu_copy_to_host(context, buffer) : 0;
}

int32_t retrograde_host_changed(retrograde_context*, halide_buffer_t* buffer) {
  buffer->flags &= ~is_overwritten;
  if (buffer->device || (buffer->flags & is_own_storage)) buffer->set_host_dirty(true);
  return 0;
}
