// Crops and slices of device memory, wrapped memory, and copies between buffers.
#include <mutex>

#include "gpu/copies.h"
#include "gpu/device_memory.h"
#include "gpu/gpu_calls.h"
#include "gpu/views.h"

namespace retrograde::runtime {
namespace {

// ---- crops and slices ----

int32_t check_view(const Request& request, const halide_buffer_t& whole,
                   const halide_buffer_t& view) {
  if (view.device != 0 || view.device_interface)
    return request.refuse("a view has no device memory of its own", "this one already has some",
                          "Free it first");
  if (whole.device_interface != retrograde_gpu_interface())
    return request.refuse(retrograde_error_incompatible_device_interface,
                          "a view is of memory of the same kind of device",
                          "the buffer's device interface is not CUDA's",
                          "Call the function of that interface");
  return 0;
}

void set_view(const halide_buffer_t& whole, int64_t offset_bytes, halide_buffer_t& view) {
  view.device = whole.device + static_cast<uint64_t>(offset_bytes);
  view.device_interface = whole.device_interface;
  view.set_device_dirty(whole.device_dirty());
}

// Checks that the view has the same dimensions except the sliced one (-1: none), and lies inside.
int32_t check_inside(const Request& request, const halide_buffer_t& whole, int sliced,
                     const halide_buffer_t& view) {
  const int dropped = sliced < 0 ? 0 : 1;
  if (whole.dimensions != view.dimensions + dropped)
    return request.refuse(
        "a crop has the dimensions of its buffer, a slice one less",
        Line("the buffer has %i, the view %i", int64_t{whole.dimensions}, int64_t{view.dimensions}),
        "Pass a view with as many dimensions");
  for (int d = 0, w = 0; d < view.dimensions; d++, w++) {
    if (w == sliced) w++;
    const halide_dimension_t &inner = view.dim[d], &outer = whole.dim[w];
    const int64_t inner_end = int64_t{inner.min} + inner.extent,
                  outer_end = int64_t{outer.min} + outer.extent;
    if (inner.extent <= 0 || (inner.min >= outer.min && inner_end <= outer_end)) continue;
    return request.refuse(
        "a view lies inside of its buffer",
        Line("in dimension %i it covers [%i, %i), the buffer [%i, %i)", int64_t{d},
             int64_t{inner.min}, inner_end, int64_t{outer.min}, outer_end),
        "Give the view a part of the buffer's coordinates");
  }
  return 0;
}

int64_t slice_offset(const halide_buffer_t& whole, int sliced, int position,
                     const halide_buffer_t& view) {
  int64_t offset = (int64_t{position} - whole.dim[sliced].min) * whole.dim[sliced].stride;
  for (int d = 0, w = 0; d < view.dimensions; d++, w++) {
    if (w == sliced) w++;
    offset += (int64_t{view.dim[d].min} - whole.dim[w].min) * whole.dim[w].stride;
  }
  return offset * whole.type.bytes();
}

int32_t check_position(const Request& request, const halide_buffer_t& whole, int sliced,
                       int position) {
  if (sliced >= 0 && sliced < whole.dimensions && position >= whole.dim[sliced].min &&
      position < int64_t{whole.dim[sliced].min} + whole.dim[sliced].extent)
    return 0;
  return request.refuse("a slice lies inside of its buffer",
                        Line("dimension %i at %i is asked for, of %i dimensions", int64_t{sliced},
                             int64_t{position}, int64_t{whole.dimensions}),
                        "Give a dimension and a position that the buffer has");
}

// ---- copies between buffers ----

int32_t check_copy(const Request& request, const halide_buffer_t& from, const halide_buffer_t& to) {
  if (from.type != to.type)
    return request.refuse(retrograde_error_bad_type, "both must hold elements of one type",
                          "theirs differ", "Copy to a buffer of the same type");
  if (from.dimensions != to.dimensions)
    return request.refuse(
        retrograde_error_bad_dimensions, "both must have the same dimensions",
        Line("they have %i and %i", int64_t{from.dimensions}, int64_t{to.dimensions}),
        "Slice or embed one of them");
  for (int d = 0; d < to.dimensions; d++) {
    const halide_dimension_t &inner = to.dim[d], &outer = from.dim[d];
    const int64_t inner_end = int64_t{inner.min} + inner.extent,
                  outer_end = int64_t{outer.min} + outer.extent;
    if (inner.extent <= 0 || (inner.min >= outer.min && inner_end <= outer_end)) continue;
    return request.refuse(
        retrograde_error_access_out_of_bounds, "the destination must lie within the source",
        Line("in dimension %i it covers [%i, %i), the source [%i, %i)", int64_t{d},
             int64_t{inner.min}, inner_end, int64_t{outer.min}, outer_end),
        "Crop it");
  }
  return 0;
}

// The side with the newest elements; the host if both have them.
Place newest_place(const halide_buffer_t& from) {
  return from.host && !from.device_dirty() ? Place::host : Place::device;
}

int32_t check_memory(const Request& request, const halide_buffer_t& from, Place from_place,
                     const halide_buffer_t& to, Place to_place) {
  if (from_place == Place::device && from.device == 0 && from.device_dirty())
    return request.refuse(retrograde_error_no_device_interface,
                          "what is newer on a device has device memory",
                          "the source's device_dirty is set, its device is 0",
                          "Set device_dirty only where a device has written");
  if (from_place == Place::device && from.device == 0)
    return request.refuse(retrograde_error_host_is_null, "both must have memory",
                          "the source has none, on the host or on a device", "Allocate it");
  if (to_place == Place::host && !to.host)
    return request.refuse(retrograde_error_host_is_null, "both must have memory",
                          "the destination has none on the host", "Allocate it");
  const bool is_foreign =
      (from_place == Place::device && from.device_interface != retrograde_gpu_interface()) ||
      (to_place == Place::device && to.device_interface != retrograde_gpu_interface());
  if (!is_foreign) return 0;
  return request.refuse(retrograde_error_incompatible_device_interface,
                        "copies are between the host and CUDA's devices",
                        "one of the buffers belongs to another device interface",
                        "Copy to the host first");
}

Context context_of(Place place, const uint8_t* pointer) {
  return place == Place::device ? context_of_memory(reinterpret_cast<Address>(pointer)) : nullptr;
}

// Waits for work of another device that may still write the source.
int32_t finish_elsewhere(const Request& request, Context context) {
  Session session(request);
  int32_t code = session.open(context);
  if (code == 0) code = wait_for_device(session);
  return session.close(code);
}

// Opens the device whose memory is written; if none is, the one whose memory is read.
int32_t open_for_copy(Session& session, Copy& copy) {
  const bool is_written = copy.to_place == Place::device;
  const uint8_t* place = is_written ? copy.to : copy.from;
  if (const int32_t code = open_for_memory(session, reinterpret_cast<Address>(place))) return code;
  const Context own = session.device().context;
  copy.from_context = context_of(copy.from_place, copy.from);
  copy.to_context = context_of(copy.to_place, copy.to);
  if (!copy.from_context) copy.from_context = own;
  if (!copy.to_context) copy.to_context = own;
  if (copy.from_context == own) return 0;
  return finish_elsewhere(session.request, copy.from_context);
}

// A copy that involves the host waits for all streams. On the device, ordering other streams is the caller's
// responsibility.
int32_t note_uses(const Session& session, const Copy& copy, bool touches_host) {
  for (const auto& [place, pointer] : {std::pair(copy.from_place, copy.from),
                                       std::pair<Place, const uint8_t*>(copy.to_place, copy.to)}) {
    const auto address = reinterpret_cast<Address>(pointer);
    if (place == Place::host || context_of_memory(address) != session.device().context) continue;
    int32_t code = touches_host ? wait_for_others(session, address) : 0;
    if (code == 0) code = note_use(session, address);
    if (code != 0) return code;
  }
  return 0;
}

int32_t copy_on_stream(const Session& session, const Copy& copy) {
  const bool touches_host = copy.from_place == Place::host || copy.to_place == Place::host;
  uint64_t capture = 0;
  if (const int32_t code = session.capture(capture)) return code;
  if (touches_host && capture != 0)
    return session.request.refuse("nothing is copied from or to the host while a graph is captured",
                                  "the stream of this call is being captured",
                                  "Copy before the capture, or after launches");
  if (const int32_t code = note_uses(session, copy, touches_host)) return code;
  if (const int32_t code = start_copy(session, copy)) return code;
  // Wait, because a stream of another device, or the host, may change the source afterwards.
  if (!touches_host && copy.from_context == copy.to_context) return 0;
  const Result result = session.driver().cuStreamSynchronize(session.stream());
  return result == success ? 0 : session.failed("cuStreamSynchronize", result);
}

}  // namespace

int32_t crop_device(const Request& request, const halide_buffer_t& whole, halide_buffer_t& view) {
  if (whole.device == 0) return 0;
  if (const int32_t code = check_view(request, whole, view)) return code;
  if (const int32_t code = check_inside(request, whole, -1, view)) return code;
  set_view(whole, offset_bytes(whole, view), view);
  return 0;
}

int32_t slice_device(const Request& request, const halide_buffer_t& whole, int sliced, int position,
                     halide_buffer_t& view) {
  if (whole.device == 0) return 0;
  if (const int32_t code = check_view(request, whole, view)) return code;
  if (const int32_t code = check_position(request, whole, sliced, position)) return code;
  if (const int32_t code = check_inside(request, whole, sliced, view)) return code;
  set_view(whole, slice_offset(whole, sliced, position, view), view);
  return 0;
}

int32_t wrap_memory(const Request& request, halide_buffer_t& buffer, uint64_t address) {
  if (buffer.device != 0 || buffer.device_interface)
    return request.refuse("a buffer has one device memory at a time", "this one already has some",
                          "Free or detach it first");
  Session session(request);
  int32_t code = session.open();
  if (code == 0) {
    Context context = nullptr;
    const Result result =
        session.driver().cuPointerGetAttribute(&context, pointer_context, address);
    if (result != success)
      code = session.failed("cuPointerGetAttribute", result,
                            Line("for the address %p", reinterpret_cast<const void*>(address)));
  }
  code = session.close(code);
  if (code != 0) return code;
  Devices& known = devices();
  const std::lock_guard lock(known.mutex);
  known.wrapped[address]++;
  buffer.device = address;
  buffer.device_interface = retrograde_gpu_interface();
  return 0;
}

int32_t detach_memory(const Request& request, halide_buffer_t& buffer) {
  if (buffer.device == 0) return 0;
  Devices& known = devices();
  const std::lock_guard lock(known.mutex);
  const auto found = known.wrapped.find(buffer.device);
  if (found == known.wrapped.end())
    return request.refuse("only memory that was wrapped is detached",
                          "this buffer's device memory was allocated for it", "Free it");
  if (--found->second == 0) known.wrapped.erase(found);
  leave_device(buffer);
  return 0;
}

void leave_device(halide_buffer_t& buffer) {
  buffer.device = 0;
  buffer.device_interface = nullptr;
  buffer.set_device_dirty(false);
}

int32_t copy_buffer(const Request& request, halide_buffer_t& from, Place to_place,
                    halide_buffer_t& to) {
  if (const int32_t code = check_copy(request, from, to)) return code;
  if (to_place == Place::device && to.device == 0) {
    if (const int32_t code = retrograde_gpu_malloc(request.caller, &to)) return code;
  }
  const Place from_place = newest_place(from);
  Copy copy = {};
  const bool is_empty = span_bytes(to) == 0;
  if (!is_empty) {
    if (const int32_t code = check_memory(request, from, from_place, to, to_place)) return code;
    plan_copy(from, from_place, to, to_place, copy);
    if (from_place == Place::host && to_place == Place::host) {
      copy_on_host(copy);
    } else {
      Session session(request);
      int32_t code = open_for_copy(session, copy);
      if (code == 0) code = copy_on_stream(session, copy);
      code = session.close(code);
      if (code != 0) return code;
    }
  }
  // The other side of the destination keeps its old elements and is no longer the newest.
  to.set_host_dirty(to_place == Place::host);
  to.set_device_dirty(to_place == Place::device);
  return 0;
}

}  // namespace retrograde::runtime

int32_t retrograde_gpu_buffer_copy(retrograde_context* caller, halide_buffer_t* from,
                                   int32_t to_device, halide_buffer_t* to) {
  using namespace retrograde::runtime;
  const Request request(caller, retrograde_error_device_buffer_copy_failed, "copy a buffer");
  if (!from || !to)
    return request.refuse(retrograde_error_buffer_is_null, "both buffers must be there",
                          "one is null", "Pass two buffers");
  return guarded(request, [&] {
    return copy_buffer(request, *from, to_device ? Place::device : Place::host, *to);
  });
}
