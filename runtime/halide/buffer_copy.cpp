// halide_buffer_copy in host memory: every element of the destination from the same coordinates of
// the source, whatever their strides. Dimension after dimension; rows that are dense in both are
// copied whole.
#include <cstring>

#include "halide/weak.h"
#include "retrograde_runtime.h"

namespace {

template <typename... Args>
int refuse(void* user_context, int code, const char* format, Args... args) {
  char message[512];
  retrograde_format_message(message, sizeof message, format, args...);
  halide_error(user_context, message);
  return code;
}

int check(void* user_context, const halide_buffer_t* from, const halide_buffer_t* to) {
  if (!from || !to)
    return refuse(user_context, halide_error_code_buffer_is_null,
                  "cannot copy a buffer: both must be there; one is null");
  if (from->device_dirty() || to->device)
    return refuse(user_context, halide_error_code_no_device_interface,
                  "cannot copy a buffer: both must be in host memory; this runtime has no devices. "
                  "Copy to the host first");
  if (!from->host || !to->host)
    return refuse(user_context, halide_error_code_host_is_null,
                  "cannot copy a buffer: both must have host memory; one has none. Allocate it");
  if (from->type != to->type)
    return refuse(user_context, halide_error_code_bad_type,
                  "cannot copy a buffer: both must hold elements of one type; theirs differ");
  if (from->dimensions != to->dimensions)
    return refuse(user_context, halide_error_code_bad_dimensions,
                  "cannot copy a buffer: both must have the same dimensions; they have %i and %i",
                  int64_t{from->dimensions}, int64_t{to->dimensions});
  for (int d = 0; d < to->dimensions; d++) {
    const halide_dimension_t &inner = to->dim[d], &outer = from->dim[d];
    const int64_t inner_end = int64_t{inner.min} + inner.extent,
                  outer_end = int64_t{outer.min} + outer.extent;
    if (inner.extent <= 0 || (inner.min >= outer.min && inner_end <= outer_end)) continue;
    return refuse(user_context, halide_error_code_access_out_of_bounds,
                  "cannot copy a buffer: the destination must lie within the source; in dimension "
                  "%i it covers [%i, %i), the source [%i, %i). Crop it",
                  int64_t{d}, int64_t{inner.min}, inner_end, int64_t{outer.min}, outer_end);
  }
  return 0;
}

void copy(const halide_buffer_t& from, const halide_buffer_t& to, const uint8_t* source,
          uint8_t* target, int dimension) {
  const auto bytes = static_cast<int64_t>(to.type.bytes());
  if (dimension < 0) {
    std::memmove(target, source, static_cast<size_t>(bytes));
    return;
  }
  const halide_dimension_t &in = from.dim[dimension], &out = to.dim[dimension];
  if (dimension == 0 && in.stride == 1 && out.stride == 1) {
    std::memmove(target, source, static_cast<size_t>(out.extent * bytes));
    return;
  }
  for (int64_t i = 0; i < out.extent; i++)
    copy(from, to, source + i * in.stride * bytes, target + i * out.stride * bytes, dimension - 1);
}

}  // namespace

RETROGRADE_WEAK int halide_buffer_copy(void* user_context, halide_buffer_t* src,
                                       const halide_device_interface_t* dst_device_interface,
                                       halide_buffer_t* dst) {
  if (dst_device_interface)
    return refuse(user_context, halide_error_code_no_device_interface,
                  "cannot copy a buffer to a device: this runtime has no devices. Leave the device "
                  "interface null");
  if (const int code = check(user_context, src, dst)) return code;
  const uint8_t* source = src->host;
  for (int d = 0; d < dst->dimensions; d++) {
    if (dst->dim[d].extent <= 0) return 0;
    source += (int64_t{dst->dim[d].min} - src->dim[d].min) * src->dim[d].stride *
              static_cast<int64_t>(src->type.bytes());
  }
  copy(*src, *dst, source, dst->host, dst->dimensions - 1);
  dst->set_host_dirty();
  return 0;
}
