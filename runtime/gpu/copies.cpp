// Translates box copies to calls of the driver: contiguous dimensions are merged, the next dimension goes to the
// driver's two-dimensional copy, and outer dimensions become loops.
#include "gpu/copies.h"

#include <algorithm>
#include <cstdlib>
#include <cstring>

namespace retrograde::runtime {
namespace {

constexpr int64_t max_pitch = 0x7fffffff;

// Reverses a dimension whose destination stride is negative.
void normalize(Copy& copy, Copy::Dimension& dim) {
  if (dim.to_stride >= 0) return;
  copy.from += (dim.extent - 1) * dim.from_stride;
  copy.to += (dim.extent - 1) * dim.to_stride;
  dim.from_stride = -dim.from_stride;
  dim.to_stride = -dim.to_stride;
}

void join_dense(Copy& copy) {
  std::sort(copy.dims.begin(), copy.dims.end(), [](const auto& a, const auto& b) {
    return std::pair(a.to_stride, std::llabs(a.from_stride)) <
           std::pair(b.to_stride, std::llabs(b.from_stride));
  });
  size_t joined = 0;
  for (; joined < copy.dims.size(); joined++) {
    const Copy::Dimension& dim = copy.dims[joined];
    if (dim.from_stride != copy.chunk_bytes || dim.to_stride != copy.chunk_bytes) break;
    copy.chunk_bytes *= dim.extent;
  }
  copy.dims.erase(copy.dims.begin(), copy.dims.begin() + static_cast<std::ptrdiff_t>(joined));
}

bool is_rows(const Copy& copy, const Copy::Dimension& dim) {
  return dim.from_stride >= copy.chunk_bytes && dim.to_stride >= copy.chunk_bytes &&
         dim.from_stride <= max_pitch && dim.to_stride <= max_pitch;
}

Address address_of(const uint8_t* pointer) { return reinterpret_cast<Address>(pointer); }

int32_t copy_between_devices(const Session& session, const Copy& copy) {
  const Context own = session.device().context;
  const Result result = session.driver().cuMemcpyPeerAsync(
      address_of(copy.to), copy.to_context ? copy.to_context : own, address_of(copy.from),
      copy.from_context ? copy.from_context : own, static_cast<size_t>(copy.chunk_bytes),
      session.stream());
  return result == success ? 0 : session.failed("cuMemcpyPeerAsync", result);
}

int32_t copy_chunk(const Session& session, const Copy& copy) {
  const Driver& driver = session.driver();
  const auto bytes = static_cast<size_t>(copy.chunk_bytes);
  const Line size("for %u bytes", uint64_t{bytes});
  if (copy.from_place == Place::host) {
    const Result result =
        driver.cuMemcpyHtoDAsync_v2(address_of(copy.to), copy.from, bytes, session.stream());
    return result == success ? 0 : session.failed("cuMemcpyHtoDAsync_v2", result, size);
  }
  if (copy.to_place == Place::host) {
    const Result result =
        driver.cuMemcpyDtoHAsync_v2(copy.to, address_of(copy.from), bytes, session.stream());
    return result == success ? 0 : session.failed("cuMemcpyDtoHAsync_v2", result, size);
  }
  if (copy.from_context != copy.to_context) return copy_between_devices(session, copy);
  const Result result = driver.cuMemcpyDtoDAsync_v2(address_of(copy.to), address_of(copy.from),
                                                    bytes, session.stream());
  return result == success ? 0 : session.failed("cuMemcpyDtoDAsync_v2", result, size);
}

int32_t copy_rows(const Session& session, const Copy& copy, const Copy::Dimension& rows) {
  Copy2D both = {};
  both.source_type = copy.from_place == Place::host ? memory_host : memory_device;
  both.source_host = copy.from_place == Place::host ? copy.from : nullptr;
  both.source_device = copy.from_place == Place::host ? 0 : address_of(copy.from);
  both.source_pitch = static_cast<size_t>(rows.from_stride);
  both.target_type = copy.to_place == Place::host ? memory_host : memory_device;
  both.target_host = copy.to_place == Place::host ? copy.to : nullptr;
  both.target_device = copy.to_place == Place::host ? 0 : address_of(copy.to);
  both.target_pitch = static_cast<size_t>(rows.to_stride);
  both.width_bytes = static_cast<size_t>(copy.chunk_bytes);
  both.height = static_cast<size_t>(rows.extent);
  const Result result = session.driver().cuMemcpy2DAsync_v2(&both, session.stream());
  return result == success
             ? 0
             : session.failed("cuMemcpy2DAsync_v2", result,
                              Line("for %i rows of %i bytes", rows.extent, copy.chunk_bytes));
}

int32_t copy_dimensions(const Session& session, const Copy& copy, size_t dimensions) {
  if (dimensions == 0) return copy_chunk(session, copy);
  const Copy::Dimension& outer = copy.dims[dimensions - 1];
  const bool is_between = copy.from_context != copy.to_context;
  if (dimensions == 1 && !is_between && is_rows(copy, outer))
    return copy_rows(session, copy, outer);
  Copy part = copy;
  for (int64_t i = 0; i < outer.extent; i++) {
    if (const int32_t code = copy_dimensions(session, part, dimensions - 1)) return code;
    part.from += outer.from_stride;
    part.to += outer.to_stride;
  }
  return 0;
}

void copy_on_host(const Copy& copy, const uint8_t* from, uint8_t* to, size_t dimensions) {
  if (dimensions == 0) {
    std::memmove(to, from, static_cast<size_t>(copy.chunk_bytes));
    return;
  }
  const Copy::Dimension& outer = copy.dims[dimensions - 1];
  for (int64_t i = 0; i < outer.extent; i++)
    copy_on_host(copy, from + i * outer.from_stride, to + i * outer.to_stride, dimensions - 1);
}

uint8_t* first_of(const halide_buffer_t& buffer, Place place) {
  return place == Place::host ? buffer.host : reinterpret_cast<uint8_t*>(buffer.device);
}

}  // namespace

bool plan_copy(const halide_buffer_t& from, Place from_place, const halide_buffer_t& to,
               Place to_place, Copy& copy) {
  const int64_t element = to.type.bytes();
  copy.from_place = from_place;
  copy.to_place = to_place;
  copy.from = first_of(from, from_place) + offset_bytes(from, to);
  copy.to = first_of(to, to_place);
  copy.chunk_bytes = element;
  for (int d = 0; d < to.dimensions; d++) {
    const halide_dimension_t &source = from.dim[d], &target = to.dim[d];
    if (target.extent <= 0) return false;
    // All elements of a dimension with stride 0 on both sides are the same element.
    if (target.extent == 1 || (source.stride == 0 && target.stride == 0)) continue;
    Copy::Dimension dim = {target.extent, source.stride * element, target.stride * element};
    normalize(copy, dim);
    copy.dims.push_back(dim);
  }
  join_dense(copy);
  return true;
}

int32_t start_copy(const Session& session, const Copy& copy) {
  return copy_dimensions(session, copy, copy.dims.size());
}

int32_t refuse_in_capture(const Session& session, const char* advice) {
  uint64_t capture = 0;
  if (const int32_t code = session.capture(capture)) return code;
  if (capture == 0) return 0;
  return session.request.refuse("nothing is copied from or to the host while a graph is captured",
                                "the stream of this call is being captured", advice);
}

void copy_on_host(const Copy& copy) { copy_on_host(copy, copy.from, copy.to, copy.dims.size()); }

}  // namespace retrograde::runtime
