// Device memory of buffers, and the copies that their dirty bits require.
//
// If a call fails, the buffer keeps its device memory and dirty bits, except in calls that free it: the newest data
// stay where they are. Threads may share a buffer. A null buffer is an error.
#pragma once

#include "gpu/layout.h"
#include "gpu/residence.h"

namespace retrograde::runtime {

// Does nothing if the buffer has device memory.
int32_t allocate_device_memory(const BufferCaller&, halide_buffer_t*);
int32_t free_device_memory(const BufferCaller&, halide_buffer_t*);
// Copies the elements if only the other side has the newest ones. Allocates device memory if there is none.
int32_t copy_newest(const BufferCaller&, halide_buffer_t*, Place to);
// Waits for the stream of this call; for a buffer, on the device that has its memory. The buffer may be null.
int32_t wait_for_stream(retrograde_context*, const halide_buffer_t*);

}  // namespace retrograde::runtime
