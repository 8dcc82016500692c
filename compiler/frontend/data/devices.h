// devices.h -- operations on the GPU memory of Buffers. Devices are CUDA's, reached through its driver or simulated
// on the CPU (RETROGRADE_GPU=simulated in the environment).
#pragma once

#include <HalideBuffer.h>

#include <string>

#include "ir/target.h"

namespace retrograde {

struct JITUserContext;

namespace Runtime = ::Halide::Runtime;

// The device interface that functions of HalideRuntime.h take for memory on `device`. Default_GPU selects the
// target's device, or CUDA if the target is unknown. The result is null for Host and None. It is also null if the
// target lacks the device and `error_site` is null; with an error site that case throws.
// Requires: devices are CUDA's (Unsupported); the target has a feature of the device.
const halide_device_interface_t* get_device_interface_for_device_api(
    DeviceAPI device, const Target& target = Target(), const char* error_site = nullptr);

namespace frontend {

// Releases the buffer's device memory and clears its dirty marks; elements that are newer there are lost.
void leave_device(Runtime::Buffer<>& buffer);

// One runtime call on a Buffer's device memory. A failure throws RuntimeError with the runtime's message; if `user`
// has an error handler, it receives the message and the call returns the error code.
class DeviceCall {
 public:
  DeviceCall(Runtime::Buffer<>& buffer, const std::string& name, const char* method,
             JITUserContext* user = nullptr)
      : buffer_(buffer), name_(name), method_(method), user_(user) {}
  int copy_to_host() const;
  int copy_to_device(DeviceAPI, const Target&) const;
  int sync() const;
  int allocate(DeviceAPI, const Target&) const;
  int free() const;
  int wrap(DeviceAPI, uint64_t handle, const Target&) const;
  int detach() const;
  // Checks that no other Buffer uses the device memory.
  void check_sole_owner(Runtime::BufferDeviceOwnership) const;
  // Checks that the device's elements are not newer than the host's.
  void check_not_newer_on_device() const;
  // Checks that the host's elements are not newer than the device's.
  void check_not_newer_on_host() const;

 private:
  template <typename Call>
  int run(Call call) const;
  const halide_device_interface_t* interface_of(DeviceAPI, const Target&) const;
  std::string asked() const;

  Runtime::Buffer<>& buffer_;
  const std::string& name_;
  const char* const method_;
  JITUserContext* const user_;
};

}  // namespace frontend
}  // namespace retrograde
