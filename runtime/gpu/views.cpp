// Crops and slices of device memory, and wrapped memory.
#include "gpu/views.h"

#include <mutex>

#include "gpu/device_memory.h"
#include "gpu/layout.h"

namespace retrograde::runtime {
namespace {

int32_t check_view(const BufferRequest& request, const halide_buffer_t& whole,
                   const halide_buffer_t& view) {
  if (view.device != 0 || view.device_interface)
    return request.refuse("a view has no device memory of its own", "this one already has some",
                          "Free it first");
  if (whole.device_interface != request.interface)
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
  const Excess excess = find_excess(whole, view, sliced);
  if (excess.dimension < 0) return 0;
  return request.refuse(
      "a view lies inside of its buffer",
      Line("in dimension %i it covers [%i, %i), the buffer [%i, %i)", int64_t{excess.dimension},
           excess.min, excess.end, excess.whole_min, excess.whole_end),
      "Give the view a part of the buffer's coordinates");
}

int64_t slice_offset(const halide_buffer_t& whole, int sliced, int position,
                     const halide_buffer_t& view) {
  const halide_dimension_t& dim = whole.dim[sliced];
  const int64_t elements = (int64_t{position} - dim.min) * dim.stride;
  return elements * whole.type.bytes() + offset_bytes(whole, view, sliced);
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

}  // namespace

int32_t crop_device(const BufferRequest& request, const halide_buffer_t& whole,
                    halide_buffer_t& view) {
  if (whole.device == 0) return 0;
  if (const int32_t code = check_view(request, whole, view)) return code;
  if (const int32_t code = check_inside(request, whole, -1, view)) return code;
  set_view(whole, offset_bytes(whole, view), view);
  return 0;
}

int32_t slice_device(const BufferRequest& request, const halide_buffer_t& whole, int sliced,
                     int position, halide_buffer_t& view) {
  if (whole.device == 0) return 0;
  if (const int32_t code = check_view(request, whole, view)) return code;
  if (const int32_t code = check_position(request, whole, sliced, position)) return code;
  if (const int32_t code = check_inside(request, whole, sliced, view)) return code;
  set_view(whole, slice_offset(whole, sliced, position, view), view);
  return 0;
}

int32_t wrap_memory(const BufferRequest& request, halide_buffer_t& buffer, uint64_t address) {
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
  enter_device(request, buffer, address);
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

}  // namespace retrograde::runtime
