/* gpu_calls.h -- what generated code calls for kernels and for buffers on devices.
 *
 * The same as the functions of HalideRuntime.h and HalideRuntimeCuda.h, with the context that generated
 * code has at hand: its error handler is told why a call failed, and its gpu_handlers say on which
 * device and stream the call works. All give 0, or a negative code. Launches and copies to the device
 * are asynchronous on the stream; copies to the host have arrived when the call is over. */
#ifndef RETROGRADE_GPU_CALLS_H
#define RETROGRADE_GPU_CALLS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct halide_buffer_t; /* of HalideRuntime.h */
struct halide_device_interface_t;

#include "retrograde_runtime.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Of CUDA devices: the real driver's or the simulated one's. Never null. */
const struct halide_device_interface_t* retrograde_gpu_interface(void);

/* Loads kernels for the device of this call unless they are there. `source` is a retrograde_gpu_image or
 * PTX that ends with 0; `bytes` is its size. `state` starts as null, belongs to one source, and may be
 * shared between threads and devices. Loaded once: a second call is cheap. */
int32_t retrograde_gpu_initialize_kernels(retrograde_context*, void** state, const void* source,
                                          int64_t bytes);
/* Starts a kernel. The sizes of arguments end with a 0. An argument that is a buffer is its
 * halide_buffer_t, and its size 8: the kernel gets its device address. */
int32_t retrograde_gpu_run(retrograde_context*, void* state, const char* name, int32_t blocks_x,
                           int32_t blocks_y, int32_t blocks_z, int32_t threads_x, int32_t threads_y,
                           int32_t threads_z, int32_t shared_bytes, const size_t* arg_sizes,
                           void* const* args, const int8_t* arg_is_buffer);
/* Called at the end of every run of a pipeline; the kernels stay loaded for the next one. */
void retrograde_gpu_finalize_kernels(retrograde_context*, void* state);
/* For who owns the code: unloads the kernels of this source everywhere, before the code goes away. */
void retrograde_gpu_forget_kernels(const void* source);

/* Device memory of a buffer, unless it has some. */
int32_t retrograde_gpu_malloc(retrograde_context*, struct halide_buffer_t*);
int32_t retrograde_gpu_free(retrograde_context*, struct halide_buffer_t*);
/* Copies where the dirty bits ask for it; to the device: allocates where nothing is yet. */
int32_t retrograde_gpu_copy_to_device(retrograde_context*, struct halide_buffer_t*);
int32_t retrograde_gpu_copy_to_host(retrograde_context*, struct halide_buffer_t*);
/* Waits for the stream of this call. The buffer may be null. */
int32_t retrograde_gpu_sync(retrograde_context*, struct halide_buffer_t*);
/* Every element of `to` from the same coordinates of `from`; `to` on the device or on the host. */
int32_t retrograde_gpu_buffer_copy(retrograde_context*, struct halide_buffer_t* from,
                                   int32_t to_device, struct halide_buffer_t* to);

/* Gives the memory that is kept for later calls back to the driver, on the device of this call. */
int32_t retrograde_gpu_release_unused(retrograde_context*);
/* For all devices: kernels are unloaded, unused memory is freed, and where none is left in use, the
 * primary contexts are let go. Not while anything runs. */
int32_t retrograde_gpu_release(retrograde_context*);

/* Device memory from the program's own allocator from now on, in the order of the stream; null: from
 * the driver again. `allocate` gives null when there is none; `release` gives 0. Both get the caller's
 * user context, and are called from any thread. */
typedef void* (*retrograde_device_allocate_t)(void* user_context, size_t bytes, void* stream);
typedef int32_t (*retrograde_device_release_t)(void* user_context, void* address, size_t bytes,
                                               void* stream);
void retrograde_set_device_allocator(retrograde_device_allocate_t, retrograde_device_release_t);

/* ---- in the static runtime alone ---- */

/* On which context and stream a call works. A program that defines one of these has its own called; it
 * may also set handlers (HalideRuntimeCuda.h). They give 0, or a code. */
int halide_cuda_acquire_context(void* user_context, void** context, bool create);
int halide_cuda_release_context(void* user_context);
int halide_cuda_get_stream(void* user_context, void* context, void** stream);

#ifdef __cplusplus
}
#endif

#endif
