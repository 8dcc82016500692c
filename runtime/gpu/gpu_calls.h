/* gpu_calls.h -- functions that generated code calls for kernels and for buffers on devices.
 *
 * They do the same as the functions of HalideRuntime.h and HalideRuntimeCuda.h, but take generated code's context.
 * Its error handler is told why a call failed, and its gpu_handlers select the device and stream. All return 0 or a
 * negative code. Launches and copies to the device are asynchronous on the stream; copies to the host are complete
 * on return. */
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

/* The interface of CUDA devices, real or simulated. Never null. */
const struct halide_device_interface_t* retrograde_gpu_interface(void);

/* Loads kernels on the device of this call unless they are loaded. `source` is a retrograde_gpu_image or
 * zero-terminated PTX; `bytes` is its size. `state` starts as null, belongs to one source, and may be shared between
 * threads and devices. Repeated calls are cheap. */
int32_t retrograde_gpu_initialize_kernels(retrograde_context*, void** state, const void* source,
                                          int64_t bytes);
/* Launches a kernel. The array of argument sizes ends with 0. A buffer argument is its halide_buffer_t, with size 8:
 * the kernel gets its device address. */
int32_t retrograde_gpu_run(retrograde_context*, void* state, const char* name, int32_t blocks_x,
                           int32_t blocks_y, int32_t blocks_z, int32_t threads_x, int32_t threads_y,
                           int32_t threads_z, int32_t shared_bytes, const size_t* arg_sizes,
                           void* const* args, const int8_t* arg_is_buffer);
/* Called at the end of every run of a pipeline; the kernels stay loaded for the next one. */
void retrograde_gpu_finalize_kernels(retrograde_context*, void* state);
/* For the owner of the code: unloads the kernels of this source on all devices, before the code is unmapped. */
void retrograde_gpu_forget_kernels(const void* source);

/* Allocates a buffer's device memory, unless it has some. */
int32_t retrograde_gpu_malloc(retrograde_context*, struct halide_buffer_t*);
int32_t retrograde_gpu_free(retrograde_context*, struct halide_buffer_t*);
/* Copies if the dirty bits require it. The copy to the device allocates device memory if there is none. */
int32_t retrograde_gpu_copy_to_device(retrograde_context*, struct halide_buffer_t*);
int32_t retrograde_gpu_copy_to_host(retrograde_context*, struct halide_buffer_t*);
/* Waits for the stream of this call. The buffer may be null. */
int32_t retrograde_gpu_sync(retrograde_context*, struct halide_buffer_t*);
/* Copies every element of `to` from the same coordinates of `from`; `to_device` selects the destination's side. */
int32_t retrograde_gpu_buffer_copy(retrograde_context*, struct halide_buffer_t* from,
                                   int32_t to_device, struct halide_buffer_t* to);

/* Gives the memory that is kept for later calls back to the driver, on the device of this call. */
int32_t retrograde_gpu_release_unused(retrograde_context*);
/* On all devices: unloads kernels, frees unused memory, and releases the primary contexts of devices without memory
 * in use. Must not be called while anything runs. */
int32_t retrograde_gpu_release(retrograde_context*);

/* Sets the program's own stream-ordered allocator for device memory; null restores the driver's. `allocate` returns
 * null on failure; `release` returns 0 on success. Both get the caller's user context, and are called from any
 * thread. */
typedef void* (*retrograde_device_allocate_t)(void* user_context, size_t bytes, void* stream);
typedef int32_t (*retrograde_device_release_t)(void* user_context, void* address, size_t bytes,
                                               void* stream);
void retrograde_set_device_allocator(retrograde_device_allocate_t, retrograde_device_release_t);

/* ---- only in the static runtime ---- */

/* The context and stream of a call. A program can define these functions itself, or set handlers
 * (HalideRuntimeCuda.h). They return 0 or an error code. */
int halide_cuda_acquire_context(void* user_context, void** context, bool create);
int halide_cuda_release_context(void* user_context);
int halide_cuda_get_stream(void* user_context, void* context, void** stream);

#ifdef __cplusplus
}
#endif

#endif
