// Crops and slices of device memory, and wrapped memory.
#pragma once

#include "gpu/residence.h"

namespace retrograde::runtime {

// `view` already has its shape. Does nothing if `whole` has no device memory.
int32_t crop_device(const BufferRequest&, const halide_buffer_t& whole, halide_buffer_t& view);
int32_t slice_device(const BufferRequest&, const halide_buffer_t& whole, int sliced, int position,
                     halide_buffer_t& view);
// Makes `address` the buffer's device memory; it still belongs to the caller.
int32_t wrap_memory(const BufferRequest&, halide_buffer_t&, uint64_t address);
int32_t detach_memory(const Request&, halide_buffer_t&);

}  // namespace retrograde::runtime
