// Where the elements of a buffer lie in memory.
#pragma once

#include <HalideRuntime.h>

namespace retrograde::runtime {

// The memory that a buffer has on the host, or that on its device.
enum class Place { host, device };

// Bytes from the first element in memory to the end of the last one.
int64_t span_bytes(const halide_buffer_t&);
// Offset of the element with the smallest coordinates from the first element in memory, in bytes.
int64_t origin_bytes(const halide_buffer_t&);
// Offset of the first element of `part` from the first element of `whole`, each the one with the smallest coordinates.
// `part` has the dimensions of `whole` except `sliced` (-1: all of them).
int64_t offset_bytes(const halide_buffer_t& whole, const halide_buffer_t& part, int sliced = -1);

// A dimension of a part whose coordinates leave the whole; -1: the part lies inside. Ranges are half-open.
struct Excess {
  int dimension = -1;
  int64_t min = 0, end = 0, whole_min = 0, whole_end = 0;
};
// The first such dimension. `part` has the dimensions of `whole` except `sliced` (-1: all of them).
Excess find_excess(const halide_buffer_t& whole, const halide_buffer_t& part, int sliced = -1);

}  // namespace retrograde::runtime
