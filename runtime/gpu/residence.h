// The device side of a buffer: its device memory, its device interface and its dirty bits.
//
// A buffer belongs to this runtime if it points to the device interface of interface.cpp. That table lists the
// functions that work on buffers, so they lie below it and get its address from their caller.
#pragma once

#include <HalideRuntime.h>

#include "gpu/driver_types.h"
#include "gpu/request.h"

namespace retrograde::runtime {

// The caller of a function for buffers, and the device interface whose buffers it may use.
struct BufferCaller {
  retrograde_context* context;
  const halide_device_interface_t* interface;
};

class BufferRequest : public Request {
 public:
  template <typename... Args>
  BufferRequest(const BufferCaller& caller, int32_t code, const char* asked, Args... args)
      : Request(caller.context, code, asked, args...), interface(caller.interface) {}

  const halide_device_interface_t* const interface;
};

// Gives the buffer device memory of the request's interface.
void enter_device(const BufferRequest&, halide_buffer_t&, cuda::Address);
// Removes the buffer from its device, so that it is only on the host.
void leave_device(halide_buffer_t&);

// Requirements; each reports an error and returns its code, or returns 0.
// The device memory exists and belongs to the request's interface.
int32_t check_device_memory(const BufferRequest&, const halide_buffer_t&);
// At most one side has newer elements.
int32_t check_dirty_bits(const Request&, const halide_buffer_t&);
// There is memory on the host, unless the buffer has no elements.
int32_t check_host_memory(const Request&, const halide_buffer_t&);

}  // namespace retrograde::runtime
