// Crops and slices of device memory, and wrapped memory.
#pragma once

#include <HalideRuntime.h>

#include "gpu/request.h"

namespace retrograde::runtime {

// `view` already has its shape. Does nothing if `whole` has no device memory.
int32_t crop_device(const Request&, const halide_buffer_t& whole, halide_buffer_t& view);
int32_t slice_device(const Request&, const halide_buffer_t& whole, int sliced, int position,
                     halide_buffer_t& view);
// Makes `address` the buffer's device memory; it still belongs to the caller.
int32_t wrap_memory(const Request&, halide_buffer_t&, uint64_t address);
int32_t detach_memory(const Request&, halide_buffer_t&);
// Removes the buffer from its device, so that it is only on the host.
void leave_device(halide_buffer_t&);

// For retrograde_gpu_release: unloads all programs.
int32_t unload_all(const Request&);

}  // namespace retrograde::runtime
