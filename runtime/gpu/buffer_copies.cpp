// Copies from one buffer to another, each in host or device memory.
#include "gpu/buffer_copies.h"

#include "gpu/buffers.h"
#include "gpu/device_memory.h"

namespace retrograde::runtime {
namespace {

int32_t check_copy(const Request& request, const halide_buffer_t& from, const halide_buffer_t& to) {
  if (from.type != to.type)
    return request.refuse(retrograde_error_bad_type, "both must hold elements of one type",
                          "theirs differ", "Copy to a buffer of the same type");
  if (from.dimensions != to.dimensions)
    return request.refuse(
        retrograde_error_bad_dimensions, "both must have the same dimensions",
        Line("they have %i and %i", int64_t{from.dimensions}, int64_t{to.dimensions}),
        "Slice or embed one of them");
  const Excess excess = find_excess(from, to);
  if (excess.dimension < 0) return 0;
  return request.refuse(
      retrograde_error_access_out_of_bounds, "the destination must lie within the source",
      Line("in dimension %i it covers [%i, %i), the source [%i, %i)", int64_t{excess.dimension},
           excess.min, excess.end, excess.whole_min, excess.whole_end),
      "Crop it");
}

// The side with the newest elements; the host if both have them.
Place newest_place(const halide_buffer_t& from) {
  return from.host && !from.device_dirty() ? Place::host : Place::device;
}

int32_t check_memory(const BufferRequest& request, const halide_buffer_t& from, Place from_place,
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
      (from_place == Place::device && from.device_interface != request.interface) ||
      (to_place == Place::device && to.device_interface != request.interface);
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
  if (touches_host) {
    if (const int32_t code =
            refuse_in_capture(session, "Copy before the capture, or after launches"))
      return code;
  }
  if (const int32_t code = note_uses(session, copy, touches_host)) return code;
  if (const int32_t code = start_copy(session, copy)) return code;
  // Wait, because a stream of another device, or the host, may change the source afterwards.
  return touches_host || copy.from_context != copy.to_context ? session.wait() : 0;
}

int32_t copy_elements(const BufferRequest& request, const halide_buffer_t& from,
                      const halide_buffer_t& to, Place to_place) {
  const Place from_place = newest_place(from);
  if (const int32_t code = check_memory(request, from, from_place, to, to_place)) return code;
  Copy copy = {};
  plan_copy(from, from_place, to, to_place, copy);
  if (from_place == Place::host && to_place == Place::host) {
    copy_on_host(copy);
    return 0;
  }
  Session session(request);
  int32_t code = open_for_copy(session, copy);
  if (code == 0) code = copy_on_stream(session, copy);
  return session.close(code);
}

int32_t check_and_copy(const BufferCaller& caller, const BufferRequest& request,
                       const halide_buffer_t& from, halide_buffer_t& to, Place to_place) {
  if (const int32_t code = check_copy(request, from, to)) return code;
  if (to_place == Place::device && to.device == 0) {
    if (const int32_t code = allocate_device_memory(caller, &to)) return code;
  }
  if (span_bytes(to) > 0) {
    if (const int32_t code = copy_elements(request, from, to, to_place)) return code;
  }
  // The other side of the destination keeps its old elements and is no longer the newest.
  to.set_host_dirty(to_place == Place::host);
  to.set_device_dirty(to_place == Place::device);
  return 0;
}

}  // namespace

int32_t copy_buffer(const BufferCaller& caller, const halide_buffer_t* from, halide_buffer_t* to,
                    Place to_place) {
  const BufferRequest request(caller, retrograde_error_device_buffer_copy_failed, "copy a buffer");
  if (!from || !to)
    return request.refuse(retrograde_error_buffer_is_null, "both buffers must be there",
                          "one is null", "Pass two buffers");
  return guarded(request, [&] { return check_and_copy(caller, request, *from, *to, to_place); });
}

}  // namespace retrograde::runtime
