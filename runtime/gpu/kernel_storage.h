/* kernel_storage.h -- functions that generated code calls to keep host and device memory consistent where needed
 * (compiler/lower/device/device_buffers.h). All return 0 or a negative code. */
#ifndef RETROGRADE_KERNEL_STORAGE_H
#define RETROGRADE_KERNEL_STORAGE_H

#include <stdint.h>

#include "gpu/gpu_calls.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Makes a one-dimensional buffer over a pipeline's internal memory, with no valid contents yet. `type`: code | bits
 * << 8 | lanes << 16. If there is no memory, calls the error handler and returns null. */
struct halide_buffer_t* retrograde_device_buffer(retrograde_context*, void* host, int64_t elements,
                                                 uint32_t type);
/* Frees it with its device memory; null is allowed. */
int32_t retrograde_device_buffer_free(retrograde_context*, struct halide_buffer_t*);

/* Announces that, until the matching end, no element of the buffer is read before it is written. So its host
 * contents are not copied to the device, unless one of the others, which may be read, is the same buffer, or the
 * host writes to it in between. Returns the argument of the matching end, which may be null. */
struct halide_buffer_t* retrograde_overwrite_begin(retrograde_context*, struct halide_buffer_t*,
                                                   int32_t num_others,
                                                   struct halide_buffer_t* const* others);
int32_t retrograde_overwrite_end(retrograde_context*, struct halide_buffer_t*);

/* Call before a kernel uses the buffer: makes its device copy valid. A buffer that is on no device yet may hold the
 * caller's data, which are copied whatever its dirty flags say. */
int32_t retrograde_to_device(retrograde_context*, struct halide_buffer_t*);
/* A kernel writes to the buffer. */
int32_t retrograde_device_changed(retrograde_context*, struct halide_buffer_t*);
/* Call before the host uses the buffer: makes its host copy valid. */
int32_t retrograde_to_host(retrograde_context*, struct halide_buffer_t*);
/* The host has written to the buffer, so a device copy is out of date. */
int32_t retrograde_host_changed(retrograde_context*, struct halide_buffer_t*);

#ifdef __cplusplus
}
#endif

#endif
