// Checks that a generated function makes of its buffers before it runs. One call makes all checks of a buffer: inlined,
// each check would be about twenty instructions, which take longer to compile than a small kernel.
#include <HalideRuntime.h>

#include <cstdlib>

#include "retrograde_runtime.h"

namespace retrograde::runtime {
namespace {

constexpr int64_t most_elements = 0x7fffffff;  // offsets are 31-bit numbers

const char* code_name(uint32_t type) {
  static constexpr const char* names[] = {"int", "uint", "float", "handle", "bfloat"};
  const uint32_t code = type & 255;
  return code < sizeof names / sizeof *names ? names[code] : "type";
}

uint32_t word_of(const halide_type_t& type) {
  return type.code | uint32_t{type.bits} << 8 | uint32_t{type.lanes} << 16;
}

int32_t wrong_type(retrograde_context* context, const char* name, uint32_t wanted, uint32_t is) {
  char text[32];
  const uint64_t bits = wanted >> 8 & 255;
  if (bits == 1)
    retrograde_format_message(text, sizeof text, "bool");
  else if ((wanted & 255) == halide_type_handle)
    retrograde_format_message(text, sizeof text, "handle");
  else
    retrograde_format_message(text, sizeof text, "%s%u", code_name(wanted), bits);
  return retrograde_report_error(
      context, retrograde_error_bad_type,
      "cannot run: the buffer \"%s\" must have elements of type %s, but its elements are of the "
      "kind %u (0: int, 1: uint, 2: float, 3: handle, 4: bfloat) with %u bits. Pass a buffer of "
      "%s.",
      name, text, uint64_t{is & 255}, uint64_t{is >> 8 & 255}, text);
}

int32_t check_extents(retrograde_context* context, const halide_buffer_t& buffer,
                      const char* name) {
  int64_t elements = 1;
  for (int32_t d = 0; d < buffer.dimensions; d++) {
    const int64_t extent = buffer.dim[d].extent;
    if (extent < 0) {
      return retrograde_report_error(
          context, retrograde_error_extents_negative,
          "cannot run: extents must not be negative; dimension %i of the buffer \"%s\" has extent "
          "%i. Pass the extent that the data has.",
          int64_t{d}, name, extent);
    }
    elements *= extent;
    if (elements > most_elements) {
      return retrograde_report_error(context, retrograde_error_extents_too_large,
                                     "cannot run: a buffer may have at most 2147483647 elements; "
                                     "\"%s\" has at least %i. Process it in tiles.",
                                     name, elements);
    }
  }
  return retrograde_error_success;
}

bool has_elements(const halide_buffer_t& buffer) {
  for (int32_t d = 0; d < buffer.dimensions; d++) {
    if (buffer.dim[d].extent <= 0) return false;
  }
  return true;
}

int32_t check_memory(retrograde_context* context, const halide_buffer_t& buffer, const char* name,
                     int32_t rules, int64_t alignment) {
  const bool is_output = rules & retrograde_region_is_written;
  const bool may_be_on_device = rules & retrograde_region_on_device;
  const bool is_there = buffer.host || (may_be_on_device && buffer.device);
  if (!is_there && has_elements(buffer)) {
    return retrograde_report_error(
        context, retrograde_error_host_is_null,
        "cannot run: data must be in memory of the host; the host pointer of the buffer \"%s\" is "
        "null, and it is on a device. Copy it to the host first.",
        name);
  }
  if (!is_output && !may_be_on_device && buffer.device_dirty()) {
    return retrograde_report_error(context, retrograde_error_device_dirty_with_no_device_support,
                                   "cannot run: data must be in memory of the host; the buffer "
                                   "\"%s\" says that the newer copy "
                                   "is on a device. Copy it to the host first.",
                                   name);
  }
  const uint64_t over = reinterpret_cast<uintptr_t>(buffer.host) % static_cast<uint64_t>(alignment);
  if (over != 0) {
    return retrograde_report_error(
        context, retrograde_error_unaligned_host_ptr,
        "cannot run: the address of the buffer \"%s\" was promised to be a multiple of %i, but its "
        "remainder is %u. Pass aligned memory, or lift the promise.",
        name, alignment, over);
  }
  return retrograde_error_success;
}

// Offsets, in elements: extents may be small and strides large.
int32_t check_span(retrograde_context* context, const halide_buffer_t& buffer, const char* name) {
  int64_t span = 0;
  for (int32_t d = 0; d < buffer.dimensions; d++) {
    const halide_dimension_t& dim = buffer.dim[d];
    if (dim.extent > 1) span += int64_t{dim.extent - 1} * std::llabs(dim.stride);
    if (span > most_elements) {
      return retrograde_report_error(
          context, retrograde_error_allocation_too_large,
          "cannot run: the elements of a buffer lie at most 2147483647 elements apart; those of "
          "\"%s\" lie up to %i apart, by its extents and strides up to dimension %i. Process it in "
          "tiles.",
          name, span, int64_t{d});
    }
  }
  return retrograde_error_success;
}

int32_t check_box(retrograde_context* context, const halide_buffer_t& buffer, const char* name,
                  bool is_output, uint32_t dimensions, const int32_t* used) {
  for (int32_t d = 0; dimensions != 0; d++, dimensions >>= 1) {
    if (!(dimensions & 1)) continue;
    const int64_t first = *used++, last = *used++;
    const int64_t min = buffer.dim[d].min, max = min + buffer.dim[d].extent - 1;
    if (min <= first && last <= max) continue;
    return retrograde_report_error(context, retrograde_error_access_out_of_bounds,
                                   "cannot run: every access must lie inside its buffer; \"%s\" is "
                                   "%s over [%i, %i] in dimension "
                                   "%i, but the buffer covers [%i, %i]. Pass a larger buffer, "
                                   "clamp the access, or use a boundary "
                                   "condition.",
                                   name, is_output ? "written" : "read", first, last, int64_t{d},
                                   min, max);
  }
  return retrograde_error_success;
}

// A dimension with at most one element may have any stride, because the stride is never used.
int32_t check_dense(retrograde_context* context, const halide_buffer_t& buffer, const char* name) {
  const int64_t stride = buffer.dim[0].stride;
  if (stride == 1 || buffer.dim[0].extent <= 1) return retrograde_error_success;
  return retrograde_report_error(context, retrograde_error_constraint_violated,
                                 "cannot run: the stride of dimension 0 of \"%s\" was promised to "
                                 "be 1, but it is %i. Pass such a "
                                 "buffer, or lift the promise with dim(0).set_stride(Expr()).",
                                 name, stride);
}

}  // namespace
}  // namespace retrograde::runtime

namespace rt = retrograde::runtime;

int32_t retrograde_check_shape(retrograde_context* context, const halide_buffer_t* buffer,
                               const char* name, int32_t type, int32_t dimensions) {
  if (!buffer) {
    return retrograde_report_error(context, retrograde_error_buffer_argument_is_null,
                                   "cannot run: the buffer argument \"%s\" is null. Pass a "
                                   "halide_buffer_t (with a null host to ask for bounds).",
                                   name);
  }
  const auto wanted = static_cast<uint32_t>(type);
  if (const uint32_t is = rt::word_of(buffer->type); is != wanted)
    return rt::wrong_type(context, name, wanted, is);
  if (buffer->dimensions != dimensions) {
    return retrograde_report_error(context, retrograde_error_bad_dimensions,
                                   "cannot run: the buffer \"%s\" must have %i dimensions, but it "
                                   "has %i. Pass a buffer with as many dimensions as the pipeline "
                                   "uses.",
                                   name, int64_t{dimensions}, int64_t{buffer->dimensions});
  }
  return rt::check_extents(context, *buffer, name);
}

int32_t retrograde_check_region(retrograde_context* context, const halide_buffer_t* buffer,
                                const char* name, int32_t rules, int32_t alignment,
                                int32_t dimensions, const int32_t* used) {
  const bool is_output = rules & retrograde_region_is_written;
  if (const int32_t code = rt::check_memory(context, *buffer, name, rules, alignment)) return code;
  if (const int32_t code = rt::check_span(context, *buffer, name)) return code;
  if (const int32_t code =
          rt::check_box(context, *buffer, name, is_output, static_cast<uint32_t>(dimensions), used))
    return code;
  return rules & retrograde_region_is_dense ? rt::check_dense(context, *buffer, name) : 0;
}

int32_t retrograde_answer_query(retrograde_context*, halide_buffer_t* buffer, int32_t dimensions,
                                const int32_t* sides) {
  for (int32_t d = 0; d < dimensions; d++, sides += 3) {
    buffer->dim[d].min = sides[0];
    buffer->dim[d].extent = sides[1];
    buffer->dim[d].stride = sides[2];
  }
  return retrograde_error_success;
}
