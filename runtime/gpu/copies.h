// Copies elements from one buffer to another, each in host or device memory.
#pragma once

#include <HalideRuntime.h>

#include "gpu/session.h"

namespace retrograde::runtime {

enum class Place { host, device };

// A copy over a box of elements: the first element of each side, and the strides.
struct Copy {
  Place from_place, to_place;
  const uint8_t* from;  // a device address if from_place is device
  uint8_t* to;
  Context from_context = nullptr,
          to_context = nullptr;  // of device memory; null: the session's context
  int64_t chunk_bytes;           // contiguous on both sides
  struct Dimension {
    int64_t extent, from_stride, to_stride;  // in bytes
  };
  std::vector<Dimension> dims;  // innermost first
};

// Plans a copy of all elements of `to` from the same coordinates of `from`, which must contain them. False if `to` has
// no elements.
bool plan_copy(const halide_buffer_t& from, Place from_place, const halide_buffer_t& to,
               Place to_place, Copy&);
// Issues the copy on the session's stream. A copy from the host has read the host's memory when this returns. A copy to
// the host is complete once the stream has been waited for.
int32_t start_copy(const Session&, const Copy&);
// A copy within the host.
void copy_on_host(const Copy&);
// Bytes from the first element in memory to the end of the last one.
int64_t span_bytes(const halide_buffer_t&);
// Offset of the element with the smallest coordinates from the first element in memory, in bytes.
int64_t origin_bytes(const halide_buffer_t&);
// Offset of the first element of `part` from the first element of `whole`, each the one with the smallest coordinates.
int64_t offset_bytes(const halide_buffer_t& whole, const halide_buffer_t& part);

}  // namespace retrograde::runtime
