// devices.h -- Buffers with memory on a GPU: CUDA's devices, by the driver or the simulated one
// (RETROGRADE_GPU=simulated in the environment).
#pragma once

#include <HalideBuffer.h>

#include <string>

#include "ir/target.h"

namespace retrograde {

struct JITUserContext;

namespace Runtime = ::Halide::Runtime;

// What HalideRuntime.h's functions want for memory on such a device. Default_GPU: CUDA, or the known
// target's. Null for Host and None, and without an error site for what a known target has not.
// Requires: devices are CUDA's (Unsupported); the target has a feature of the device.
const halide_device_interface_t* get_device_interface_for_device_api(
    DeviceAPI device, const Target& target = Target(), const char* error_site = nullptr);

namespace frontend {

// As if it had never had device memory.
void leave_device(Runtime::Buffer<>& buffer);

// One call of the runtime on a Buffer's device memory. They throw RuntimeError with what the runtime says;
// the error handler of `user`, where there is one, is told instead, and the code comes back.
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
  // Its memory on devices is its own: no other Buffer has a part in it.
  void check_sole_owner(Runtime::BufferDeviceOwnership) const;
  // The newest elements are not on a device.
  void check_not_newer_on_device() const;
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
