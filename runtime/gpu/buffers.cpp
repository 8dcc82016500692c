// Buffers on devices: their memory, and the copies that their dirty bits require.
//
// A buffer's `device` is the address of the element with the smallest coordinates, like `host`, so strides mean the
// same in both. If a call fails, the buffer keeps its device memory and dirty bits, except in calls that free it: the
// newest data stay where they are.
#include <array>

#include "gpu/copies.h"
#include "gpu/device_memory.h"
#include "gpu/gpu_calls.h"
#include "gpu/views.h"

namespace retrograde::runtime {
namespace {

// A lock for each buffer, chosen by its address, so that threads that share a buffer copy it once.
std::mutex& lock_of(const halide_buffer_t* buffer) {
  static std::array<std::mutex, 64>& locks = *new std::array<std::mutex, 64>;
  return locks[(reinterpret_cast<uintptr_t>(buffer) >> 4) % locks.size()];
}

// ---- requirements on a buffer ----

int32_t check_there(const Request& request, const halide_buffer_t* buffer) {
  return buffer ? 0
                : request.refuse(retrograde_error_buffer_is_null, "there must be a buffer",
                                 "the pointer is null", "Pass a halide_buffer_t");
}

int32_t check_ours(const Request& request, const halide_buffer_t& buffer) {
  if (buffer.device_interface == retrograde_gpu_interface()) {
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

int32_t check_bits(const Request& request, const halide_buffer_t& buffer) {
  if (!buffer.host_dirty() || !buffer.device_dirty()) return 0;
  return request.refuse(retrograde_error_host_and_device_dirty,
                        "the newest elements are in one place",
                        "both host_dirty and device_dirty are set",
                        "Copy after writing on one side, before writing on the other");
}

int32_t check_host(const Request& request, const halide_buffer_t& buffer) {
  if (buffer.host || span_bytes(buffer) == 0) return 0;
  return request.refuse(retrograde_error_host_is_null, "a copy needs memory on the host",
                        "the buffer has none", "Allocate it");
}

// ---- memory ----

int32_t allocate(const Request& request, halide_buffer_t& buffer) {
  if (buffer.device != 0 || buffer.device_interface) return check_ours(request, buffer);
  Session session(request);
  int32_t code = session.open();
  Address base = 0;
  if (code == 0) code = allocate_block(session, static_cast<size_t>(span_bytes(buffer)), base);
  code = session.close(code);
  if (code != 0) {
    if (base != 0) return_block(base);
    return code;
  }
  buffer.device = base + static_cast<uint64_t>(origin_bytes(buffer));
  buffer.device_interface = retrograde_gpu_interface();
  return 0;
}

// Base of the block that contains the address; 0 if there is none.
Address base_of(Address address) {
  Devices& known = devices();
  const std::lock_guard lock(known.mutex);
  const Block* block = find_live_block(known, address);
  return block ? block->base : 0;
}

// Ignores the buffer's shape: its strides may have changed since the allocation.
int32_t free_memory(const Request& request, halide_buffer_t& buffer) {
  if (buffer.device == 0 && !buffer.device_interface) return 0;
  if (const int32_t code = check_ours(request, buffer)) return code;
  const Address base = base_of(buffer.device);
  if (base == 0)
    return request.refuse(
        "only memory that this runtime allocated is freed by it",
        Line("nothing that it allocated is at %p", reinterpret_cast<const void*>(buffer.device)),
        "Detach memory that was wrapped, and free everything once");
  const int32_t code = release_block(request, base);
  leave_device(buffer);
  return code;
}

// ---- copies ----

int32_t wait(const Session& session) {
  const Result result = session.driver().cuStreamSynchronize(session.stream());
  return result == success ? 0 : session.failed("cuStreamSynchronize", result);
}

int32_t refuse_in_capture(const Session& session) {
  uint64_t capture = 0;
  if (const int32_t code = session.capture(capture)) return code;
  if (capture == 0) return 0;
  return session.request.refuse(
      "nothing is copied from or to the host while a graph is captured",
      "the stream of this call is being captured",
      "Copy inputs to the device before the capture, and results to the host after launches");
}

// The driver has read pageable memory when a copy call returns. It reads page-locked memory later, when the caller may
// have changed it; so wait for it.
int32_t wait_for_locked_memory(const Session& session, const void* host) {
  // This form for several attributes does not fail for memory that the driver does not know.
  unsigned type = 0;
  const int attribute = pointer_memory_type;
  void* value = &type;
  const Result result = session.driver().cuPointerGetAttributes(1, &attribute, &value,
                                                                reinterpret_cast<Address>(host));
  if (result != success) return session.failed("cuPointerGetAttributes", result);
  return type == 0 ? 0 : wait(session);
}

int32_t copy_in(const Session& session, halide_buffer_t& buffer) {
  Copy copy = {};
  if (!plan_copy(buffer, Place::host, buffer, Place::device, copy)) return 0;
  if (const int32_t code = refuse_in_capture(session)) return code;
  if (const int32_t code = wait_for_others(session, buffer.device)) return code;
  if (const int32_t code = note_use(session, buffer.device)) return code;
  if (const int32_t code = start_copy(session, copy)) return code;
  return wait_for_locked_memory(session, copy.from);
}

int32_t copy_out(const Session& session, halide_buffer_t& buffer) {
  Copy copy = {};
  if (!plan_copy(buffer, Place::device, buffer, Place::host, copy)) return 0;
  if (const int32_t code = refuse_in_capture(session)) return code;
  if (const int32_t code = wait_for_others(session, buffer.device)) return code;
  if (const int32_t code = note_use(session, buffer.device)) return code;
  if (const int32_t code = start_copy(session, copy)) return code;
  return wait(session);
}

int32_t copy_to_device(const Request& request, halide_buffer_t& buffer) {
  if (buffer.device == 0 || !buffer.device_interface) {
    if (const int32_t code = allocate(request, buffer)) return code;
  } else if (const int32_t code = check_ours(request, buffer)) {
    return code;
  }
  if (!buffer.host_dirty()) return 0;
  if (const int32_t code = check_bits(request, buffer)) return code;
  if (const int32_t code = check_host(request, buffer)) return code;
  Session session(request);
  int32_t code = open_for_memory(session, buffer.device);
  if (code == 0) code = copy_in(session, buffer);
  code = session.close(code);
  if (code == 0) buffer.set_host_dirty(false);
  return code;
}

int32_t copy_to_host(const Request& request, halide_buffer_t& buffer) {
  if (!buffer.device_dirty()) return 0;
  if (const int32_t code = check_bits(request, buffer)) return code;
  if (const int32_t code = check_ours(request, buffer)) return code;
  if (const int32_t code = check_host(request, buffer)) return code;
  Session session(request);
  int32_t code = open_for_memory(session, buffer.device);
  if (code == 0) code = copy_out(session, buffer);
  code = session.close(code);
  if (code == 0) buffer.set_device_dirty(false);
  return code;
}

// Runs one of the functions above under the buffer's lock.
template <typename Work>
int32_t locked(const Request& request, halide_buffer_t* buffer, Work work) {
  if (const int32_t code = check_there(request, buffer)) return code;
  return guarded(request, [&] {
    const std::lock_guard lock(lock_of(buffer));
    return work(request, *buffer);
  });
}

}  // namespace
}  // namespace retrograde::runtime

namespace rt = retrograde::runtime;

int32_t retrograde_gpu_malloc(retrograde_context* caller, halide_buffer_t* buffer) {
  const int64_t bytes = buffer ? rt::span_bytes(*buffer) : 0;
  const rt::Request request(caller, retrograde_error_device_malloc_failed,
                            "allocate device memory for a buffer of %i bytes", bytes);
  return rt::locked(request, buffer, rt::allocate);
}

int32_t retrograde_gpu_free(retrograde_context* caller, halide_buffer_t* buffer) {
  const rt::Request request(caller, retrograde_error_device_free_failed,
                            "free the device memory of a buffer");
  return rt::locked(request, buffer, rt::free_memory);
}

int32_t retrograde_gpu_copy_to_device(retrograde_context* caller, halide_buffer_t* buffer) {
  const int64_t bytes = buffer ? rt::span_bytes(*buffer) : 0;
  const rt::Request request(caller, retrograde_error_copy_to_device_failed,
                            "copy a buffer of %i bytes to a device", bytes);
  return rt::locked(request, buffer, rt::copy_to_device);
}

int32_t retrograde_gpu_copy_to_host(retrograde_context* caller, halide_buffer_t* buffer) {
  const int64_t bytes = buffer ? rt::span_bytes(*buffer) : 0;
  const rt::Request request(caller, retrograde_error_copy_to_host_failed,
                            "copy a buffer of %i bytes to the host", bytes);
  return rt::locked(request, buffer, rt::copy_to_host);
}

int32_t retrograde_gpu_sync(retrograde_context* caller, halide_buffer_t* buffer) {
  if (buffer && buffer->device == 0) return 0;
  const rt::Request request(caller, retrograde_error_device_sync_failed, "wait for a device");
  return guarded(request, [&] {
    rt::Session session(request);
    int32_t code = buffer ? rt::open_for_memory(session, buffer->device) : session.open();
    if (code == 0) code = rt::wait(session);
    return session.close(code);
  });
}
