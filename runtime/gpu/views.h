// Views of device memory and memory of the caller's.
#pragma once

#include <HalideRuntime.h>

#include "gpu/request.h"

namespace retrograde::runtime {

// `view` has its shape already; nothing is done where the whole has no device memory.
int32_t crop_device(const Request&, const halide_buffer_t& whole, halide_buffer_t& view);
int32_t slice_device(const Request&, const halide_buffer_t& whole, int sliced, int position,
                     halide_buffer_t& view);
// `address` becomes the buffer's device memory; it stays the caller's.
int32_t wrap_memory(const Request&, halide_buffer_t&, uint64_t address);
int32_t detach_memory(const Request&, halide_buffer_t&);
// The buffer is on the host alone from now on.
void leave_device(halide_buffer_t&);

// Of retrograde_gpu_release: of all programs.
int32_t unload_all(const Request&);

}  // namespace retrograde::runtime
