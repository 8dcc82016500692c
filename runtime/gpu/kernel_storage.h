/* kernel_storage.h -- what generated code calls to keep host and device the same where it is needed
 * (compiler/lower/device/device_buffers.h). All give 0, or a negative code. */
#ifndef RETROGRADE_KERNEL_STORAGE_H
#define RETROGRADE_KERNEL_STORAGE_H

#include <stdint.h>

#include "gpu/gpu_calls.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A buffer of one dimension over memory of the pipeline, with nothing in it yet; `type`: code | bits << 8
 * | lanes << 16. Null, and the error handler told, when there is no memory for it. */
struct halide_buffer_t* retrograde_device_buffer(retrograde_context*, void* host, int64_t elements,
                                                 uint32_t type);
/* With its memory on the device. Null is one, too. */
int32_t retrograde_device_buffer_free(retrograde_context*, struct halide_buffer_t*);

/* Until the end, no element of the buffer is read before it is stored: what the host has of it is not
 * copied to the device, unless one of the others, which may be read, is the same buffer, or the host stores
 * into it on the way. Gives what the end is told; null is that, too. */
struct halide_buffer_t* retrograde_overwrite_begin(retrograde_context*, struct halide_buffer_t*,
                                                   int32_t num_others,
                                                   struct halide_buffer_t* const* others);
int32_t retrograde_overwrite_end(retrograde_context*, struct halide_buffer_t*);

/* Before a kernel touches it: what the host has is on the device. A buffer that is on no device yet may
 * hold what the caller gave: that is copied, whatever its flags say. */
int32_t retrograde_to_device(retrograde_context*, struct halide_buffer_t*);
/* A kernel stores into it. */
int32_t retrograde_device_changed(retrograde_context*, struct halide_buffer_t*);
/* Before the host touches it: what a kernel stored is there. */
int32_t retrograde_to_host(retrograde_context*, struct halide_buffer_t*);
/* The host has stored into it: where it is on a device, that has the old values. */
int32_t retrograde_host_changed(retrograde_context*, struct halide_buffer_t*);

#ifdef __cplusplus
}
#endif

#endif
