// The device side of a buffer, and the requirements on it.
#include "gpu/residence.h"

#include "gpu/layout.h"

namespace retrograde::runtime {

void enter_device(const BufferRequest& request, halide_buffer_t& buffer, cuda::Address address) {
  buffer.device = address;
  buffer.device_interface = request.interface;
}

void leave_device(halide_buffer_t& buffer) {
  buffer.device = 0;
  buffer.device_interface = nullptr;
  buffer.set_device_dirty(false);
}

int32_t check_device_memory(const BufferRequest& request, const halide_buffer_t& buffer) {
  if (buffer.device_interface == request.interface) {
    if (buffer.device != 0) return 0;
    return request.refuse(retrograde_error_device_interface_no_device,
                          "a buffer with a device interface has device memory", "its device is 0",
                          "Leave both fields to the runtime");
  }
  if (!buffer.device_interface)
    return request.refuse(retrograde_error_no_device_interface,
                          "device memory belongs to a device interface",
                          "the buffer's device is set, its device_interface is null",
                          "Leave both fields to the runtime");
  return request.refuse(
      retrograde_error_incompatible_device_interface, "a buffer is on one kind of device at a time",
      "it belongs to another device interface than CUDA's", "Free its device memory first");
}

int32_t check_dirty_bits(const Request& request, const halide_buffer_t& buffer) {
  if (!buffer.host_dirty() || !buffer.device_dirty()) return 0;
  return request.refuse(retrograde_error_host_and_device_dirty,
                        "the newest elements are in one place",
                        "both host_dirty and device_dirty are set",
                        "Copy after writing on one side, before writing on the other");
}

int32_t check_host_memory(const Request& request, const halide_buffer_t& buffer) {
  if (buffer.host || span_bytes(buffer) == 0) return 0;
  return request.refuse(retrograde_error_host_is_null, "a copy needs memory on the host",
                        "the buffer has none", "Allocate it");
}

}  // namespace retrograde::runtime
