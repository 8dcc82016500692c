#include "device.h"

#include <dlfcn.h>

#include <array>

namespace device_check {
namespace {

// Calls a function of the driver; its signature is the published one, and 0 means success.
template <typename... Args>
bool succeeds(void* library, const char* function, Args... args) {
  const auto call = reinterpret_cast<int (*)(Args...)>(dlsym(library, function));
  return call && call(args...) == 0;
}

}  // namespace

Device find_device() {
  Device device;
  void* driver = dlopen("libcuda.so.1", RTLD_NOW);
  int count = 0, major = 0, minor = 0;
  if (!driver) {
    device.why_none = "libcuda.so.1, CUDA's driver, is not among the system's libraries";
  } else if (!succeeds(driver, "cuInit", 0u) || !succeeds(driver, "cuDeviceGetCount", &count) ||
             count == 0) {
    device.why_none = "CUDA's driver finds no device";
  } else {
    constexpr int major_attribute = 75, minor_attribute = 76;
    const int number = count - 1;  // as the runtime chooses
    std::array<char, 256> name = {};
    succeeds(driver, "cuDeviceGetName", name.data(), static_cast<int>(name.size() - 1), number);
    succeeds(driver, "cuDeviceGetAttribute", &major, major_attribute, number);
    succeeds(driver, "cuDeviceGetAttribute", &minor, minor_attribute, number);
    succeeds(driver, "cuDriverGetVersion", &device.driver_version);
    device.name = name.data();
    device.capability = 10 * major + minor;
    if (device.capability < 75)
      device.why_none = device.name + " is of compute capability " + std::to_string(major) + "." +
                        std::to_string(minor) + ", and kernels are made for 7.5 and later";
  }
  return device;
}

}  // namespace device_check
