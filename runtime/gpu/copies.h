// Copies of the elements of one buffer to another, whichever memory each of them is in.
#pragma once

#include <HalideRuntime.h>

#include "gpu/session.h"

namespace retrograde::runtime {

enum class Place { host, device };

// Elements over a box: where the first of each side is, and how far apart the others are.
struct Copy {
  Place from_place, to_place;
  const uint8_t* from;  // an address in device memory where the place says so
  uint8_t* to;
  Context from_context = nullptr, to_context = nullptr;  // of device memory; null: the session's
  int64_t chunk_bytes;                                   // dense in both
  struct Dimension {
    int64_t extent, from_stride, to_stride;  // in bytes
  };
  std::vector<Dimension> dims;  // the innermost first
};

// Of all elements of `to`, from the same coordinates of `from`, which has them. Empty: no elements.
bool plan_copy(const halide_buffer_t& from, Place from_place, const halide_buffer_t& to,
               Place to_place, Copy&);
// Asks the driver for it, on the session's stream. A copy from the host has left the host's memory when
// this is over; one to the host has arrived when the stream was waited for.
int32_t start_copy(const Session&, const Copy&);
// A copy within the host.
void copy_on_host(const Copy&);
// Bytes from the first to behind the last element.
int64_t span_bytes(const halide_buffer_t&);
// How far behind the first of them the element of the smallest coordinates is.
int64_t origin_bytes(const halide_buffer_t&);
// The element of the smallest coordinates of `part` in `whole`, behind that of `whole`.
int64_t offset_bytes(const halide_buffer_t& whole, const halide_buffer_t& part);

}  // namespace retrograde::runtime
