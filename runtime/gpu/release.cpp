// Releases everything that is kept: unused memory, kernels, primary contexts.
#include "gpu/device_memory.h"
#include "gpu/gpu_calls.h"
#include "gpu/programs.h"

namespace retrograde::runtime {
namespace {

std::vector<DeviceState*> all_devices() {
  Devices& known = devices();
  const std::lock_guard lock(known.mutex);
  std::vector<DeviceState*> all;
  for (DeviceState& state : known.all) all.push_back(&state);
  return all;
}

int32_t release_memory(const Request& request, const DeviceState& device) {
  Session session(request);
  int32_t code = session.open(device.context);
  if (code == 0) code = release_unused(session);
  return session.close(code);
}

bool is_in_use(const Devices& known, const DeviceState& device) {
  if (!device.unused.empty()) return true;
  for (const auto& [base, block] : known.live) {
    if (block.device == &device) return true;
  }
  return false;
}

// Removes a device that nothing uses, with its primary context.
int32_t forget_device(const Request& request, const Driver& driver, const DeviceState* device) {
  Devices& known = devices();
  const std::lock_guard lock(known.mutex);
  if (is_in_use(known, *device)) return 0;
  if (device->is_retained) {
    const Result result = driver.cuDevicePrimaryCtxRelease_v2(device->number);
    if (result != success)
      return request.driver_failed(driver, "cuDevicePrimaryCtxRelease_v2", result);
  }
  known.all.remove_if([&](const DeviceState& state) { return &state == device; });
  return 0;
}

int32_t release_everything(const Request& request, const Driver& driver) {
  int32_t first = unload_all(request);
  const bool all_unloaded = first == 0;
  for (const DeviceState* device : all_devices()) {
    int32_t code = release_memory(request, *device);
    if (code == 0 && all_unloaded) code = forget_device(request, driver, device);
    if (first == 0) first = code;
  }
  return first;
}

}  // namespace
}  // namespace retrograde::runtime

namespace rt = retrograde::runtime;

int32_t retrograde_gpu_release_unused(retrograde_context* caller) {
  if (!rt::driver_if_open()) return 0;
  const rt::Request request(caller, retrograde_error_device_free_failed,
                            "give unused device memory back");
  return guarded(request, [&] {
    rt::Session session(request);
    int32_t code = session.open();
    if (code == 0) code = rt::release_unused(session);
    return session.close(code);
  });
}

int32_t retrograde_gpu_release(retrograde_context* caller) {
  const rt::Driver* driver = rt::driver_if_open();
  if (!driver) return 0;
  const rt::Request request(caller, retrograde_error_device_free_failed, "release the devices");
  return guarded(request, [&] { return rt::release_everything(request, *driver); });
}
