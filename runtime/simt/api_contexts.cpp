// The simulated driver's functions for devices, contexts and errors.
#include <cstring>

#include "simt/call.h"

namespace retrograde::simt {
namespace {

bool is_device(Device device) { return device >= 0 && device < options().devices; }

ContextState& make_context(Device device) {
  auto context = std::make_unique<ContextState>();
  context->device = device;
  context->references = 1;
  context->default_stream.context = context.get();
  ContextState& made = *context;
  state().contexts.insert(std::move(context));
  return made;
}

void destroy_context(ContextState& context) {
  if (context.lost == success) complete_all(context);
  state().memory[context.device].free_all(&context);
  erase_from(state().contexts, &context);
}

ContextState* primary_of(Device device) {
  for (const auto& context : state().contexts) {
    if (context->is_primary && context->device == device) return context.get();
  }
  return nullptr;
}

// Attributes of a device of compute capability 9.0.
Result attribute_of(int attribute, int& value) {
  switch (attribute) {
    case attribute_max_threads:
      value = 1024;
      return success;
    case attribute_shared_bytes:
      value = 48 << 10;
      return success;
    case attribute_shared_bytes_opt_in:
      value = 227 << 10;
      return success;
    case attribute_warp_size:
      value = 32;
      return success;
    case attribute_max_pitch:
      value = 0x7fffffff;
      return success;
    case attribute_multiprocessors:
      value = 132;
      return success;
    case attribute_major:
      value = 9;
      return success;
    case attribute_minor:
      value = 0;
      return success;
    default:
      return invalid_value;
  }
}

struct ErrorText {
  Result result;
  const char *name, *text;
};
constexpr ErrorText errors[] = {
    {success, "CUDA_SUCCESS", "no error"},
    {invalid_value, "CUDA_ERROR_INVALID_VALUE", "invalid argument"},
    {out_of_memory, "CUDA_ERROR_OUT_OF_MEMORY", "out of memory"},
    {not_initialized, "CUDA_ERROR_NOT_INITIALIZED", "initialization error"},
    {no_device, "CUDA_ERROR_NO_DEVICE", "no CUDA-capable device is detected"},
    {invalid_device, "CUDA_ERROR_INVALID_DEVICE", "invalid device ordinal"},
    {invalid_image, "CUDA_ERROR_INVALID_IMAGE", "device kernel image is invalid"},
    {invalid_context, "CUDA_ERROR_INVALID_CONTEXT", "invalid device context"},
    {invalid_source, "CUDA_ERROR_INVALID_SOURCE", "device kernel image is invalid"},
    {invalid_handle, "CUDA_ERROR_INVALID_HANDLE", "invalid resource handle"},
    {illegal_state, "CUDA_ERROR_ILLEGAL_STATE", "the operation cannot be performed in this state"},
    {not_found, "CUDA_ERROR_NOT_FOUND", "named symbol not found"},
    {not_ready, "CUDA_ERROR_NOT_READY", "device not ready"},
    {illegal_address, "CUDA_ERROR_ILLEGAL_ADDRESS", "an illegal memory access was encountered"},
    {launch_out_of_resources, "CUDA_ERROR_LAUNCH_OUT_OF_RESOURCES",
     "too many resources requested for launch"},
    {launch_failed, "CUDA_ERROR_LAUNCH_FAILED", "unspecified launch failure"},
    {capture_unsupported, "CUDA_ERROR_STREAM_CAPTURE_UNSUPPORTED",
     "operation not permitted when stream is capturing"},
    {capture_invalidated, "CUDA_ERROR_STREAM_CAPTURE_INVALIDATED",
     "operation failed due to a previous error during capture"},
    {capture_unmatched, "CUDA_ERROR_STREAM_CAPTURE_UNMATCHED",
     "capture was not ended in the same stream as it began"},
    {capture_implicit, "CUDA_ERROR_STREAM_CAPTURE_IMPLICIT",
     "operation would make the legacy stream depend on a capturing blocking stream"},
    {unknown_error, "CUDA_ERROR_UNKNOWN", "unknown error"}};

const ErrorText* find_error(Result result) {
  for (const ErrorText& error : errors) {
    if (error.result == result) return &error;
  }
  return nullptr;
}

// For a kernel's error, adds what the simulated device found in it.
const char* text_of(const ErrorText& error) {
  thread_local std::string text;
  const bool is_kernels = error.result == illegal_address || error.result == launch_failed;
  if (!is_kernels || finding().empty()) return error.text;
  text = std::string(error.text) + ": " + finding();
  return text.c_str();
}

}  // namespace
}  // namespace retrograde::simt

using namespace retrograde::simt;

RETROGRADE_SIMT_EXPORT Result cuInit(unsigned flags) {
  const std::lock_guard lock(driver_mutex());
  if (const Result verdict = begin_call("cuInit"); verdict != success) return verdict;
  if (flags != 0) return invalid_value;
  if (options().devices == 0) return no_device;
  state().is_initialized = true;
  return success;
}

RETROGRADE_SIMT_EXPORT Result cuGetErrorName(Result result, const char** name) {
  const std::lock_guard lock(driver_mutex());
  if (const Result verdict = begin_call("cuGetErrorName"); verdict != success) return verdict;
  const ErrorText* error = find_error(result);
  *name = error ? error->name : nullptr;
  return error ? success : invalid_value;
}

RETROGRADE_SIMT_EXPORT Result cuGetErrorString(Result result, const char** text) {
  const std::lock_guard lock(driver_mutex());
  if (const Result verdict = begin_call("cuGetErrorString"); verdict != success) return verdict;
  const ErrorText* error = find_error(result);
  *text = error ? text_of(*error) : nullptr;
  return error ? success : invalid_value;
}

RETROGRADE_SIMT_EXPORT Result cuDriverGetVersion(int* version) {
  const std::lock_guard lock(driver_mutex());
  if (const Result verdict = begin_call("cuDriverGetVersion"); verdict != success) return verdict;
  *version = 12000;
  return success;
}

// ---- devices ----

RETROGRADE_SIMT_EXPORT Result cuDeviceGetCount(int* count) {
  return call("cuDeviceGetCount", [&]() -> Result {
    *count = options().devices;
    return success;
  });
}

RETROGRADE_SIMT_EXPORT Result cuDeviceGet(Device* device, int ordinal) {
  return call("cuDeviceGet", [&]() -> Result {
    if (!is_device(ordinal)) return invalid_device;
    *device = ordinal;
    return success;
  });
}

RETROGRADE_SIMT_EXPORT Result cuDeviceGetName(char* name, int bytes, Device device) {
  return call("cuDeviceGetName", [&]() -> Result {
    if (!is_device(device) || bytes <= 0) return invalid_value;
    std::strncpy(name, "simulated device", static_cast<size_t>(bytes) - 1);
    name[bytes - 1] = 0;
    return success;
  });
}

RETROGRADE_SIMT_EXPORT Result cuDeviceGetAttribute(int* value, int attribute, Device device) {
  return call("cuDeviceGetAttribute", [&]() -> Result {
    return is_device(device) ? attribute_of(attribute, *value) : Result{invalid_device};
  });
}

RETROGRADE_SIMT_EXPORT Result cuDeviceTotalMem_v2(size_t* bytes, Device device) {
  return call("cuDeviceTotalMem_v2", [&]() -> Result {
    if (!is_device(device)) return invalid_device;
    *bytes = options().memory_bytes;
    return success;
  });
}

// ---- contexts ----

RETROGRADE_SIMT_EXPORT Result cuDevicePrimaryCtxRetain(Context* context, Device device) {
  return call("cuDevicePrimaryCtxRetain", [&]() -> Result {
    if (!is_device(device)) return invalid_device;
    ContextState* primary = primary_of(device);
    if (primary) {
      primary->references++;
    } else {
      primary = &make_context(device);
      primary->is_primary = true;
    }
    *context = primary;
    return success;
  });
}

RETROGRADE_SIMT_EXPORT Result cuDevicePrimaryCtxRelease_v2(Device device) {
  return call("cuDevicePrimaryCtxRelease_v2", [&]() -> Result {
    ContextState* primary = primary_of(device);
    if (!primary) return invalid_context;
    if (--primary->references == 0) destroy_context(*primary);
    return success;
  });
}

RETROGRADE_SIMT_EXPORT Result cuCtxCreate_v2(Context* context, unsigned, Device device) {
  return call("cuCtxCreate_v2", [&]() -> Result {
    if (!is_device(device)) return invalid_device;
    *context = current_context() = &make_context(device);
    return success;
  });
}

RETROGRADE_SIMT_EXPORT Result cuCtxDestroy_v2(Context handle) {
  return call("cuCtxDestroy_v2", [&]() -> Result {
    ContextState* context = find_in(state().contexts, handle);
    if (!context || context->is_primary) return invalid_context;
    if (current_context() == context) current_context() = nullptr;
    destroy_context(*context);
    return success;
  });
}

RETROGRADE_SIMT_EXPORT Result cuCtxGetCurrent(Context* context) {
  return call("cuCtxGetCurrent", [&]() -> Result {
    *context = find_in(state().contexts, current_context());
    return success;
  });
}

RETROGRADE_SIMT_EXPORT Result cuCtxSetCurrent(Context handle) {
  return call("cuCtxSetCurrent", [&]() -> Result {
    ContextState* context = find_in(state().contexts, handle);
    if (handle && !context) return invalid_context;
    current_context() = context;
    return success;
  });
}

RETROGRADE_SIMT_EXPORT Result cuCtxGetDevice(Device* device) {
  return call_in_context("cuCtxGetDevice", [&](ContextState& context) -> Result {
    *device = context.device;
    return success;
  });
}

RETROGRADE_SIMT_EXPORT Result cuCtxSynchronize() {
  return call_in_context("cuCtxSynchronize", [&](ContextState& context) -> Result {
    if (const Result refused = refuse_in_capture(); refused != success) return refused;
    return complete_all(context);
  });
}

// ---- queries and controls for tests ----

void retrograde_simt_lose_device(int32_t number) {
  const std::lock_guard lock(driver_mutex());
  set_finding("the device was lost");
  for (const auto& context : state().contexts) {
    if (context->device == number) context->lost = launch_failed;
  }
}

const char* retrograde_simt_last_finding(void) {
  thread_local std::string text;
  const std::lock_guard lock(driver_mutex());
  text = finding();
  return text.c_str();
}

void retrograde_simt_count_live(retrograde_simt_live* live) {
  const std::lock_guard lock(driver_mutex());
  *live = {};
  for (const auto& [device, memory] : state().memory) {
    live->allocations += static_cast<int64_t>(memory.live().size());
    live->allocated_bytes += static_cast<int64_t>(memory.used_bytes());
  }
  for (const auto& context : state().contexts) {
    live->contexts++;
    live->modules += static_cast<int64_t>(context->modules.size());
    live->streams += static_cast<int64_t>(context->streams.size());
    live->pending += static_cast<int64_t>(context->pending.size());
  }
  live->events = static_cast<int64_t>(state().events.size());
  live->graphs = static_cast<int64_t>(state().graphs.size());
}
