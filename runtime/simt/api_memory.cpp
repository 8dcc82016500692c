// The simulated driver's functions for memory and copies. A copy from pageable host memory reads it at once, as the
// real driver does by staging it. A copy to pageable host memory is complete on return.
#include <cstring>

#include "simt/call.h"

namespace retrograde::simt {
namespace {

// The device whose live memory contains the address; null if none does.
DeviceMemory* find_memory(Address address, size_t bytes) {
  for (auto& [device, memory] : state().memory) {
    if (memory.find(address, bytes)) return &memory;
  }
  return nullptr;
}

bool is_locked(const void* host) {
  const auto* byte = static_cast<const uint8_t*>(host);
  auto next = state().locked_host.upper_bound(byte);
  if (next == state().locked_host.begin()) return false;
  const auto& [begin, bytes] = *std::prev(next);
  return byte < begin + bytes;
}

uint8_t* pointer(Address address) { return reinterpret_cast<uint8_t*>(address); }

// One side of a copy: rows of bytes.
struct Side {
  bool is_host;
  uint8_t* first;
  size_t pitch;
};

size_t span(const Side& side, size_t width, size_t height) {
  return (height - 1) * side.pitch + width;
}

bool is_there(const Side& side, size_t width, size_t height) {
  return side.is_host ||
         find_memory(reinterpret_cast<Address>(side.first), span(side, width, height));
}

void copy_rows(const uint8_t* from, size_t from_pitch, uint8_t* to, size_t to_pitch, size_t width,
               size_t height) {
  for (size_t y = 0; y < height; y++) std::memmove(to + y * to_pitch, from + y * from_pitch, width);
}

Result copy_from_pageable(StreamState& stream, const Side& from, const Side& to, size_t width,
                          size_t height) {
  std::vector<uint8_t> staged(width * height);
  copy_rows(from.first, from.pitch, staged.data(), width, width, height);
  return enqueue(stream, [staged, to, width, height]() -> Result {
    copy_rows(staged.data(), width, to.first, to.pitch, width, height);
    return success;
  });
}

void count_copied(const Side& from, const Side& to, size_t bytes) {
  retrograde_simt_copied& sum = state().copied;
  (to.is_host     ? sum.to_host
   : from.is_host ? sum.to_device
                  : sum.between_devices) += static_cast<int64_t>(bytes);
}

Result copy(StreamState& stream, const Side& from, const Side& to, size_t width, size_t height) {
  if (width == 0 || height == 0) return success;
  if (!is_there(from, width, height) || !is_there(to, width, height)) return invalid_value;
  count_copied(from, to, width * height);
  const bool from_pageable = from.is_host && !is_locked(from.first);
  const bool to_pageable = to.is_host && !is_locked(to.first);
  if (from_pageable || to_pageable) {
    if (const Result refused = refuse_on(stream); refused != success) return refused;
  }
  if (from_pageable) return copy_from_pageable(stream, from, to, width, height);
  const Result result = enqueue(stream, [from, to, width, height]() -> Result {
    copy_rows(from.first, from.pitch, to.first, to.pitch, width, height);
    return success;
  });
  return result == success && to_pageable ? complete_stream(stream) : result;
}

Side on_host(const void* first, size_t pitch = 0) {
  return {true, static_cast<uint8_t*>(const_cast<void*>(first)), pitch};
}
Side on_device(Address first, size_t pitch = 0) { return {false, pointer(first), pitch}; }

Side source_of(const Copy2D& c) {
  const size_t offset = c.source_y * c.source_pitch + c.source_x;
  return c.source_type == memory_host
             ? on_host(static_cast<const uint8_t*>(c.source_host) + offset, c.source_pitch)
             : on_device(c.source_device + offset, c.source_pitch);
}
Side target_of(const Copy2D& c) {
  const size_t offset = c.target_y * c.target_pitch + c.target_x;
  return c.target_type == memory_host
             ? on_host(static_cast<uint8_t*>(c.target_host) + offset, c.target_pitch)
             : on_device(c.target_device + offset, c.target_pitch);
}

bool is_type(unsigned type) { return type == memory_host || type == memory_device; }
bool is_legal(const Copy2D& c) {
  constexpr size_t most = 0x7fffffff;
  return is_type(c.source_type) && is_type(c.target_type) && c.source_pitch >= c.width_bytes &&
         c.target_pitch >= c.width_bytes && c.source_pitch <= most && c.target_pitch <= most;
}

// Returns false if the address has no attribute of that kind.
bool attribute_of(Address address, int attribute, void* value) {
  DeviceMemory* memory = find_memory(address, 1);
  if (attribute == pointer_memory_type) {
    if (!memory && !is_locked(pointer(address))) return false;
    *static_cast<unsigned*>(value) = memory ? memory_device : memory_host;
    return true;
  }
  if (attribute != pointer_context || !memory) return false;
  *static_cast<Context*>(value) = memory->find(address, 1)->context;
  return true;
}

// Runs `work` on a stream. Rejects the call if it would involve a stream that is being captured in this context.
template <typename Work>
Result copy_on(const char* function, Stream handle, Work work) {
  return call_on_stream(function, handle, [&](StreamState& stream) -> Result {
    if (!stream.capture) {
      if (const Result refused = refuse_on(stream); refused != success) return refused;
    }
    return work(stream);
  });
}

}  // namespace
}  // namespace retrograde::simt

using namespace retrograde::simt;

RETROGRADE_SIMT_EXPORT Result cuMemAlloc_v2(Address* address, size_t bytes) {
  return call_in_context("cuMemAlloc_v2", [&](ContextState& context) -> Result {
    if (const Result refused = refuse_in_capture(); refused != success) return refused;
    return state().memory[context.device].allocate(bytes, &context, *address);
  });
}

// Waits for all work of the context, because it may use the memory.
RETROGRADE_SIMT_EXPORT Result cuMemFree_v2(Address address) {
  return call_in_context("cuMemFree_v2", [&](ContextState& context) -> Result {
    if (const Result refused = refuse_in_capture(); refused != success) return refused;
    if (const Result result = complete_all(context); result != success) return result;
    DeviceMemory* memory = find_memory(address, 1);
    return memory ? memory->free(address) : Result{invalid_value};
  });
}

RETROGRADE_SIMT_EXPORT Result cuMemGetInfo_v2(size_t* free, size_t* total) {
  return call_in_context("cuMemGetInfo_v2", [&](ContextState& context) -> Result {
    *total = options().memory_bytes;
    *free = *total - state().memory[context.device].used_bytes();
    return success;
  });
}

RETROGRADE_SIMT_EXPORT Result cuMemHostRegister_v2(void* host, size_t bytes, unsigned) {
  return call_in_context("cuMemHostRegister_v2", [&](ContextState&) -> Result {
    state().locked_host[static_cast<uint8_t*>(host)] = bytes;
    return success;
  });
}

RETROGRADE_SIMT_EXPORT Result cuMemHostUnregister(void* host) {
  return call_in_context("cuMemHostUnregister", [&](ContextState& context) -> Result {
    if (const Result result = complete_all(context); result != success) return result;
    return state().locked_host.erase(static_cast<uint8_t*>(host)) ? success : invalid_value;
  });
}

RETROGRADE_SIMT_EXPORT Result cuPointerGetAttribute(void* value, int attribute, Address address) {
  return call_in_context("cuPointerGetAttribute", [&](ContextState&) -> Result {
    return attribute_of(address, attribute, value) ? success : Result{invalid_value};
  });
}

// Unknown attributes are 0 and not an error.
RETROGRADE_SIMT_EXPORT Result cuPointerGetAttributes(unsigned count, const int* attributes,
                                                     void** values, Address address) {
  return call_in_context("cuPointerGetAttributes", [&](ContextState&) -> Result {
    for (unsigned i = 0; i < count; i++) {
      const bool is_context = attributes[i] == pointer_context;
      if (!is_context && attributes[i] != pointer_memory_type) return invalid_value;
      std::memset(values[i], 0, is_context ? sizeof(Context) : sizeof(unsigned));
      attribute_of(address, attributes[i], values[i]);
    }
    return success;
  });
}

// ---- copies ----

RETROGRADE_SIMT_EXPORT Result cuMemcpyHtoDAsync_v2(Address to, const void* from, size_t bytes,
                                                   Stream handle) {
  return copy_on("cuMemcpyHtoDAsync_v2", handle, [&](StreamState& stream) {
    return copy(stream, on_host(from), on_device(to), bytes, 1);
  });
}

RETROGRADE_SIMT_EXPORT Result cuMemcpyDtoHAsync_v2(void* to, Address from, size_t bytes,
                                                   Stream handle) {
  return copy_on("cuMemcpyDtoHAsync_v2", handle, [&](StreamState& stream) {
    return copy(stream, on_device(from), on_host(to), bytes, 1);
  });
}

RETROGRADE_SIMT_EXPORT Result cuMemcpyDtoDAsync_v2(Address to, Address from, size_t bytes,
                                                   Stream handle) {
  return copy_on("cuMemcpyDtoDAsync_v2", handle, [&](StreamState& stream) {
    return copy(stream, on_device(from), on_device(to), bytes, 1);
  });
}

RETROGRADE_SIMT_EXPORT Result cuMemcpy2DAsync_v2(const Copy2D* both, Stream handle) {
  return copy_on("cuMemcpy2DAsync_v2", handle, [&](StreamState& stream) -> Result {
    if (!is_legal(*both)) return invalid_value;
    return copy(stream, source_of(*both), target_of(*both), both->width_bytes, both->height);
  });
}

RETROGRADE_SIMT_EXPORT Result cuMemcpyPeerAsync(Address to, Context to_context, Address from,
                                                Context from_context, size_t bytes, Stream handle) {
  return copy_on("cuMemcpyPeerAsync", handle, [&](StreamState& stream) -> Result {
    if (!find_in(state().contexts, to_context) || !find_in(state().contexts, from_context))
      return invalid_context;
    return copy(stream, on_device(from), on_device(to), bytes, 1);
  });
}

void retrograde_simt_count_copied(retrograde_simt_copied* out) {
  const std::lock_guard lock(driver_mutex());
  *out = state().copied;
}
