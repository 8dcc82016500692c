// Copies elements from one buffer to another, each in host or device memory.
#pragma once

#include <HalideRuntime.h>

#include "gpu/layout.h"
#include "gpu/session.h"

namespace retrograde::runtime {

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
// For copies from or to the host: reports an error if the stream is being captured into a graph.
int32_t refuse_in_capture(const Session&, const char* advice);
// A copy within the host.
void copy_on_host(const Copy&);

}  // namespace retrograde::runtime
