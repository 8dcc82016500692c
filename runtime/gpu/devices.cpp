// Devices and their primary contexts.
#include "gpu/devices.h"

namespace retrograde::runtime {
namespace {

DeviceState* find(Devices& known, Context context) {
  for (DeviceState& state : known.all) {
    if (state.context == context) return &state;
  }
  return nullptr;
}

DeviceState* find_retained(Devices& known, int number) {
  for (DeviceState& state : known.all) {
    if (state.is_retained && state.number == number) return &state;
  }
  return nullptr;
}

int32_t look_at_device(const Request& request, const Driver& driver, Device device,
                       DeviceState& state) {
  state.number = device;
  const Result result = driver.cuDeviceTotalMem_v2(&state.memory_bytes, device);
  return result == success ? 0 : request.driver_failed(driver, "cuDeviceTotalMem_v2", result);
}

int32_t device_of_number(const Request& request, const Driver& driver, int number, Device& device) {
  int count = 0;
  if (const Result result = driver.cuDeviceGetCount(&count); result != success)
    return request.driver_failed(driver, "cuDeviceGetCount", result);
  if (count == 0)
    return request.refuse("there must be a device", "the driver knows of none",
                          "Check it with nvidia-smi");
  if (number >= count || number < -1)
    return request.refuse(
        "devices are numbered from 0; -1 is the last one",
        Line("number %i was asked for, and there are %i", int64_t{number}, int64_t{count}),
        "Give another number to halide_set_gpu_device, or in HL_GPU_DEVICE");
  const Result result = driver.cuDeviceGet(&device, number < 0 ? count - 1 : number);
  return result == success ? 0 : request.driver_failed(driver, "cuDeviceGet", result);
}

}  // namespace

// Never destroyed: threads may still use it when the process exits.
Devices& devices() {
  static Devices& known = *new Devices;
  return known;
}

int32_t primary_context(const Request& request, const Driver& driver, int number,
                        Context& context) {
  Devices& known = devices();
  const std::lock_guard lock(known.mutex);
  Device device = number < 0 ? known.last : number;
  const DeviceState* retained = find_retained(known, device);
  if (!retained) {
    if (const int32_t code = device_of_number(request, driver, number, device)) return code;
    if (number < 0) known.last = device;
    retained = find_retained(known, device);
  }
  if (retained) {
    context = retained->context;
    return 0;
  }
  known.all.emplace_back();  // first, so that nothing can fail after the context is retained
  DeviceState& state = known.all.back();
  int32_t code = look_at_device(request, driver, device, state);
  if (code == 0) {
    const Result result = driver.cuDevicePrimaryCtxRetain(&state.context, device);
    if (result != success) code = request.driver_failed(driver, "cuDevicePrimaryCtxRetain", result);
  }
  if (code != 0) {
    known.all.pop_back();
    return code;
  }
  state.is_retained = true;
  context = state.context;
  return 0;
}

int32_t state_of_context(const Request& request, const Driver& driver, Context context,
                         DeviceState*& found) {
  Devices& known = devices();
  const std::lock_guard lock(known.mutex);
  found = find(known, context);
  if (found) return 0;
  Device device = 0;
  if (const Result result = driver.cuCtxGetDevice(&device); result != success)
    return request.driver_failed(driver, "cuCtxGetDevice", result);
  DeviceState state;
  state.context = context;
  if (const int32_t code = look_at_device(request, driver, device, state)) return code;
  found = &known.all.emplace_back(std::move(state));
  return 0;
}

}  // namespace retrograde::runtime
