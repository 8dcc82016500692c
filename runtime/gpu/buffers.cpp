// Device memory of buffers, and the copies that their dirty bits require.
//
// A buffer's `device` is the address of the element with the smallest coordinates, like `host`, so strides mean the
// same in both.
#include "gpu/buffers.h"

#include <array>

#include "gpu/copies.h"
#include "gpu/device_memory.h"

namespace retrograde::runtime {
namespace {

// A lock for each buffer, chosen by its address, so that threads that share a buffer copy it once.
std::mutex& lock_of(const halide_buffer_t* buffer) {
  static std::array<std::mutex, 64>& locks = *new std::array<std::mutex, 64>;
  return locks[(reinterpret_cast<uintptr_t>(buffer) >> 4) % locks.size()];
}

// ---- memory ----

int32_t allocate(const BufferRequest& request, halide_buffer_t& buffer) {
  if (buffer.device != 0 || buffer.device_interface) return check_device_memory(request, buffer);
  Session session(request);
  int32_t code = session.open();
  Address base = 0;
  if (code == 0) code = allocate_block(session, static_cast<size_t>(span_bytes(buffer)), base);
  code = session.close(code);
  if (code != 0) {
    if (base != 0) return_block(base);
    return code;
  }
  enter_device(request, buffer, base + static_cast<uint64_t>(origin_bytes(buffer)));
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
int32_t free_memory(const BufferRequest& request, halide_buffer_t& buffer) {
  if (buffer.device == 0 && !buffer.device_interface) return 0;
  if (const int32_t code = check_device_memory(request, buffer)) return code;
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
  return type == 0 ? 0 : session.wait();
}

// Copies the newest elements to the other side.
int32_t copy_elements(const Session& session, const halide_buffer_t& buffer, Place to) {
  const Place from = to == Place::host ? Place::device : Place::host;
  Copy copy = {};
  if (!plan_copy(buffer, from, buffer, to, copy)) return 0;
  if (const int32_t code =
          refuse_in_capture(session,
                            "Copy inputs to the device before the capture, and results "
                            "to the host after launches"))
    return code;
  if (const int32_t code = wait_for_others(session, buffer.device)) return code;
  if (const int32_t code = note_use(session, buffer.device)) return code;
  if (const int32_t code = start_copy(session, copy)) return code;
  return to == Place::host ? session.wait() : wait_for_locked_memory(session, copy.from);
}

int32_t check_and_copy(const BufferRequest& request, const halide_buffer_t& buffer, Place to) {
  if (const int32_t code = check_dirty_bits(request, buffer)) return code;
  if (const int32_t code = check_device_memory(request, buffer)) return code;
  if (const int32_t code = check_host_memory(request, buffer)) return code;
  Session session(request);
  int32_t code = open_for_memory(session, buffer.device);
  if (code == 0) code = copy_elements(session, buffer, to);
  return session.close(code);
}

int32_t update_device(const BufferRequest& request, halide_buffer_t& buffer) {
  const bool has_memory = buffer.device != 0 && buffer.device_interface;
  int32_t code = has_memory ? check_device_memory(request, buffer) : allocate(request, buffer);
  if (code != 0 || !buffer.host_dirty()) return code;
  code = check_and_copy(request, buffer, Place::device);
  if (code == 0) buffer.set_host_dirty(false);
  return code;
}

int32_t update_host(const BufferRequest& request, halide_buffer_t& buffer) {
  if (!buffer.device_dirty()) return 0;
  const int32_t code = check_and_copy(request, buffer, Place::host);
  if (code == 0) buffer.set_device_dirty(false);
  return code;
}

// ---- calls ----

// Runs one of the functions above under the buffer's lock. `asked` may name the buffer's size.
template <typename Work>
int32_t run_locked(const BufferCaller& caller, halide_buffer_t* buffer, int32_t code,
                   const char* asked, Work work) {
  const BufferRequest request(caller, code, asked, buffer ? span_bytes(*buffer) : 0);
  if (!buffer) return request.refuse_null_buffer();
  return guarded(request, [&] {
    const std::lock_guard lock(lock_of(buffer));
    return work(request, *buffer);
  });
}

}  // namespace

int32_t allocate_device_memory(const BufferCaller& caller, halide_buffer_t* buffer) {
  return run_locked(caller, buffer, retrograde_error_device_malloc_failed,
                    "allocate device memory for a buffer of %i bytes", allocate);
}

int32_t free_device_memory(const BufferCaller& caller, halide_buffer_t* buffer) {
  return run_locked(caller, buffer, retrograde_error_device_free_failed,
                    "free the device memory of a buffer", free_memory);
}

int32_t copy_newest(const BufferCaller& caller, halide_buffer_t* buffer, Place to) {
  if (to == Place::device)
    return run_locked(caller, buffer, retrograde_error_copy_to_device_failed,
                      "copy a buffer of %i bytes to a device", update_device);
  return run_locked(caller, buffer, retrograde_error_copy_to_host_failed,
                    "copy a buffer of %i bytes to the host", update_host);
}

int32_t wait_for_stream(retrograde_context* caller, const halide_buffer_t* buffer) {
  if (buffer && buffer->device == 0) return 0;
  const Request request(caller, retrograde_error_device_sync_failed, "wait for a device");
  return guarded(request, [&] {
    Session session(request);
    int32_t code = buffer ? open_for_memory(session, buffer->device) : session.open();
    if (code == 0) code = session.wait();
    return session.close(code);
  });
}

}  // namespace retrograde::runtime
