// Where the elements of a buffer lie in memory.
#include "gpu/layout.h"

#include <cstdlib>

namespace retrograde::runtime {
namespace {

// The dimension of the whole that is dimension `d` of its part.
int dimension_of_whole(int d, int sliced) { return sliced >= 0 && d >= sliced ? d + 1 : d; }

}  // namespace

int64_t span_bytes(const halide_buffer_t& buffer) {
  int64_t elements = 1;
  for (int d = 0; d < buffer.dimensions; d++) {
    const halide_dimension_t& dim = buffer.dim[d];
    if (dim.extent <= 0) return 0;
    elements += (int64_t{dim.extent} - 1) * std::llabs(dim.stride);
  }
  return elements * buffer.type.bytes();
}

int64_t origin_bytes(const halide_buffer_t& buffer) {
  int64_t origin = 0;
  for (int d = 0; d < buffer.dimensions; d++) {
    const halide_dimension_t& dim = buffer.dim[d];
    if (dim.stride < 0 && dim.extent > 0) origin -= (int64_t{dim.extent} - 1) * dim.stride;
  }
  return origin * buffer.type.bytes();
}

int64_t offset_bytes(const halide_buffer_t& whole, const halide_buffer_t& part, int sliced) {
  int64_t offset = 0;
  for (int d = 0; d < part.dimensions; d++) {
    const halide_dimension_t& outer = whole.dim[dimension_of_whole(d, sliced)];
    offset += (int64_t{part.dim[d].min} - outer.min) * outer.stride;
  }
  return offset * whole.type.bytes();
}

Excess find_excess(const halide_buffer_t& whole, const halide_buffer_t& part, int sliced) {
  for (int d = 0; d < part.dimensions; d++) {
    const halide_dimension_t &inner = part.dim[d],
                             &outer = whole.dim[dimension_of_whole(d, sliced)];
    const int64_t end = int64_t{inner.min} + inner.extent;
    const int64_t whole_end = int64_t{outer.min} + outer.extent;
    if (inner.extent <= 0 || (inner.min >= outer.min && end <= whole_end)) continue;
    return {d, inner.min, end, outer.min, whole_end};
  }
  return {};
}

}  // namespace retrograde::runtime
