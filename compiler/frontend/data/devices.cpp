// devices.cpp -- runtime calls on the GPU memory of Buffers. Conditions that the runtime's own Buffer would assert
// are checked first, and error codes become exceptions with the runtime's message.
#include "frontend/data/devices.h"

#include "diagnostics/error.h"
#include "frontend/run/call.h"
#include "gpu/gpu_calls.h"
#include "report.h"

namespace retrograde {
namespace {

// The runtime's Buffer counts the sharers of device memory in a private member, without an accessor, and aborts when
// it frees shared memory. An explicit instantiation may name a private member, which gives us the count.
using CountMember = Runtime::DeviceRefCount* Runtime::Buffer<>::*;
CountMember count_member();
template <CountMember member>
struct Reach {
  friend CountMember count_member() { return member; }
};
template struct Reach<&Runtime::Buffer<>::dev_ref_count>;

bool is_shared(const Runtime::Buffer<>& buffer) {
  const Runtime::DeviceRefCount* count = buffer.*count_member();
  return count && count->count > 1;
}

}  // namespace

const halide_device_interface_t* get_device_interface_for_device_api(DeviceAPI device,
                                                                     const Target& target,
                                                                     const char* error_site) {
  // An unknown target allows every device.
  if (!target.has_unknowns() && !target.supports_device_api(device)) {
    if (!error_site) return nullptr;
    user_error(error_site, "the target has a feature of the device",
               text("the target is ", quoted(target.to_string())),
               "Add a feature such as Target::CUDA to the target, or name no target");
  }
  if (device == DeviceAPI::Default_GPU)
    device = target.has_gpu_feature() ? get_default_device_api_for_target(target) : DeviceAPI::CUDA;
  if (device == DeviceAPI::CUDA) return retrograde_gpu_interface();
  if (device == DeviceAPI::Host || device == DeviceAPI::None) return nullptr;
  unsupported(error_site ? error_site : "find the interface of a device", "devices are CUDA's",
              text("the device API ", static_cast<int>(device), " was named"),
              "Name DeviceAPI::CUDA, or a target with the feature cuda");
}

namespace frontend {

// The runtime's Buffer aborts when it drops device memory that is newer or that cannot be freed. Here an error of
// device_free is ignored: no caller is left to report it to, and the runtime retries the release.
void leave_device(Runtime::Buffer<>& buffer) {
  if (!buffer.has_device_allocation()) return;
  buffer.set_device_dirty(false);
  halide_buffer_t& raw = *buffer.raw_buffer();
  const bool is_own = buffer.device_ownership() == Runtime::BufferDeviceOwnership::Allocated;
  if (is_own && !is_shared(buffer)) raw.device_interface->device_free(nullptr, &raw);
  buffer.device_deallocate();
}

std::string DeviceCall::asked() const {
  return text("call ", method_, "() on the Buffer ", quoted(name_));
}

template <typename Call>
int DeviceCall::run(Call call) const {
  return prepared({}, user_, [&] {
    runtime::Failure failure;
    const runtime::FailureScope scope(&failure);
    const int code = call();
    if (code != 0)
      throw RuntimeError(text("the Buffer ", quoted(name_), ": ", failure.message), code);
  });
}

const halide_device_interface_t* DeviceCall::interface_of(DeviceAPI device,
                                                          const Target& target) const {
  const halide_device_interface_t* found =
      get_device_interface_for_device_api(device, target, asked().c_str());
  if (!found)
    user_error(asked(), "a GPU must be named", "the host was named", "Name DeviceAPI::CUDA");
  return found;
}

// ---- checks ----

void DeviceCall::check_not_newer_on_device() const {
  if (!buffer_.device_dirty()) return;
  call_error(asked(), "its newest elements must be on the host", "they are on a device",
             "Call copy_to_host() first", halide_error_code_host_and_device_dirty);
}

void DeviceCall::check_not_newer_on_host() const {
  if (!buffer_.host_dirty()) return;
  call_error(asked(), "its newest elements must not be on the host alone", "host_dirty is set",
             "Call copy_to_device() first, or set_host_dirty(false)",
             halide_error_code_host_and_device_dirty);
}

void DeviceCall::check_sole_owner(Runtime::BufferDeviceOwnership expected) const {
  const bool frees = expected == Runtime::BufferDeviceOwnership::Allocated;
  if (buffer_.device_ownership() != expected && frees) {
    call_error(asked(), "only memory that the Buffer allocated is freed",
               "its device memory was wrapped, or is a part of another Buffer's",
               "Detach it, or free the Buffer that it is a part of",
               halide_error_code_device_free_failed);
  }
  if (buffer_.device_ownership() != expected) {
    call_error(asked(), "only memory that was wrapped is detached", "its device memory was not",
               "Free it", halide_error_code_device_detach_native_failed);
  }
  if (is_shared(buffer_))
    call_error(asked(), "no other Buffer may use its device memory",
               "an alias, crop or slice of it does", "Let go of those first",
               halide_error_code_device_free_failed);
}

// ---- calls ----

int DeviceCall::copy_to_host() const {
  return run([&] { return buffer_.copy_to_host(); });
}

int DeviceCall::copy_to_device(DeviceAPI device, const Target& target) const {
  const auto* interface = interface_of(device, target);
  return run([&] { return buffer_.copy_to_device(interface); });
}

int DeviceCall::sync() const {
  return run([&] { return buffer_.device_sync(); });
}

int DeviceCall::allocate(DeviceAPI device, const Target& target) const {
  const auto* interface = interface_of(device, target);
  return run([&] { return buffer_.device_malloc(interface); });
}

int DeviceCall::free() const {
  if (!buffer_.has_device_allocation()) return 0;
  return run([&] {
    check_sole_owner(Runtime::BufferDeviceOwnership::Allocated);
    return buffer_.device_free();
  });
}

int DeviceCall::wrap(DeviceAPI device, uint64_t handle, const Target& target) const {
  const auto* interface = interface_of(device, target);
  return run([&] {
    if (buffer_.has_device_allocation())
      call_error(asked(), "a Buffer has one device memory at a time", "it already has some",
                 "Free or detach it first", halide_error_code_device_wrap_native_failed);
    return buffer_.device_wrap_native(interface, handle);
  });
}

int DeviceCall::detach() const {
  if (!buffer_.has_device_allocation()) return 0;
  return run([&] {
    check_sole_owner(Runtime::BufferDeviceOwnership::WrappedNative);
    return buffer_.device_detach_native();
  });
}

}  // namespace frontend
}  // namespace retrograde
