/* retrograde_runtime.h -- the C ABI between generated code and its host.
 *
 * A generated function is
 *
 *     int32_t name(retrograde_context *, <halide_buffer_t * or scalar>...);
 *     int32_t name_argv(retrograde_context *, void **args);
 *
 * where args[i] is the halide_buffer_t * itself, or a pointer to the scalar. It returns 0 or a negative code of
 * retrograde_error_code. A null context means one whose fields are all zero.
 *
 * Nothing here prints, aborts, exits or throws. Every function may be called from several threads at once. The
 * process-wide state is: the thread pool, the pool of free memory blocks (retrograde_pool_*), the cache of memoized
 * results (retrograde_memoization_*), the profiler's data (retrograde_profiler_*), and the arenas of thread limits. */
#ifndef RETROGRADE_RUNTIME_H
#define RETROGRADE_RUNTIME_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* HalideRuntime.h's values for these conditions, under our own names. */
enum retrograde_error_code {
  retrograde_error_success = 0,
  retrograde_error_generic = -1,
  retrograde_error_explicit_bounds_too_small = -2,
  retrograde_error_bad_type = -3,
  retrograde_error_access_out_of_bounds = -4,
  retrograde_error_allocation_too_large = -5,
  retrograde_error_extents_too_large = -6,
  retrograde_error_constraints_make_required_region_smaller = -7,
  retrograde_error_constraint_violated = -8,
  retrograde_error_param_too_small = -9,
  retrograde_error_param_too_large = -10,
  retrograde_error_out_of_memory = -11,
  retrograde_error_buffer_argument_is_null = -12,
  retrograde_error_debug_to_file_failed = -13,
  retrograde_error_copy_to_host_failed = -14,
  retrograde_error_copy_to_device_failed = -15,
  retrograde_error_device_malloc_failed = -16,
  retrograde_error_device_sync_failed = -17,
  retrograde_error_device_free_failed = -18,
  retrograde_error_no_device_interface = -19,
  retrograde_error_internal = -22,
  retrograde_error_device_run_failed = -23,
  retrograde_error_unaligned_host_ptr = -24,
  retrograde_error_bad_fold = -25,
  retrograde_error_fold_factor_too_small = -26,
  retrograde_error_requirement_failed = -27,
  retrograde_error_extents_negative = -28,
  retrograde_error_specialize_fail = -31,
  retrograde_error_device_wrap_native_failed = -32,
  retrograde_error_device_detach_native_failed = -33,
  retrograde_error_host_is_null = -34,
  retrograde_error_device_interface_no_device = -36,
  retrograde_error_host_and_device_dirty = -37,
  retrograde_error_buffer_is_null = -38,
  retrograde_error_device_buffer_copy_failed = -39,
  retrograde_error_device_crop_failed = -41,
  retrograde_error_incompatible_device_interface = -42,
  retrograde_error_bad_dimensions = -43,
  retrograde_error_device_dirty_with_no_device_support = -44,
  retrograde_error_storage_bound_too_small = -45
};

struct retrograde_context;
struct halide_trace_event_t; /* of HalideRuntime.h */

/* One iteration of a parallel loop. */
typedef int32_t (*retrograde_task)(struct retrograde_context*, int32_t index, uint8_t* closure);

/* Selects the device and stream of a call; a null member means the default. They return 0 or an error code. */
typedef struct retrograde_gpu_handlers {
  /* The CUcontext. Default: that of the selected device (halide_set_gpu_device, HL_GPU_DEVICE); else the thread's
   * current one; else the primary context of the last device. */
  int32_t (*acquire_context)(struct retrograde_context*, void** cuda_context, int32_t create);
  int32_t (*release_context)(struct retrograde_context*);
  /* The CUstream, which all work of the call uses. Default: the context's default stream. */
  int32_t (*get_stream)(struct retrograde_context*, void* cuda_context, void** stream);
} retrograde_gpu_handlers;

/* Settings of one call, or a family of calls, of generated code. A field that is null or zero means the default. The
 * handlers get the context that the generated function was called with. */
typedef struct retrograde_context {
  /* Called for every error, just before its code is returned. If several iterations of a parallel loop fail, it is
   * called once after the loop, for the lowest iteration. Default: errors are not reported. */
  void (*error_handler)(struct retrograde_context*, int code, const char* message);
  /* Gets the text of print() and print_when(), one line at a time and from any thread. Default: the text is
   * discarded. */
  void (*print_handler)(struct retrograde_context*, const char* message);
  /* Allocates memory for intermediate results, aligned to retrograde_allocation_alignment; returns null on failure.
   * Set both or neither. Default: the process-wide pool, see retrograde_pool_malloc. */
  void* (*malloc_handler)(struct retrograde_context*, size_t bytes);
  void (*free_handler)(struct retrograde_context*, void* block);
  /* Number of threads that parallel loops may use, including the caller's. 0: all threads of the pool. */
  int32_t thread_limit;
  /* For the handlers; not used here. */
  void* user_data;
  /* Runs a parallel loop in place of the thread pool: calls the task for every index of [min, min + extent) and
   * returns 0, or the code of an iteration that failed. */
  int32_t (*parallel_handler)(struct retrograde_context*, retrograde_task, int32_t min,
                              int32_t extent, uint8_t* closure);
  /* Runs one iteration of a parallel loop: calls the task and returns its code. The default does only that. */
  int32_t (*task_handler)(struct retrograde_context*, retrograde_task, int32_t index,
                          uint8_t* closure);
  /* Called for every event of a traced pipeline, from any thread; returns the event's number, which later events
   * name as their parent. Default: retrograde_default_trace. */
  int32_t (*trace_handler)(struct retrograde_context*, const struct halide_trace_event_t*);
  /* Default: null, which means that all members are null. */
  const retrograde_gpu_handlers* gpu_handlers;
} retrograde_context;

/* ---- called by generated code ---- */

enum { retrograde_allocation_alignment = 128 };

/* Runs task for every index of [min, min + extent), in any order and in parallel. If iterations fail, the result is
 * the code of the lowest failing one, and iterations above it may be skipped. */
int32_t retrograde_parallel_for(retrograde_context*, retrograde_task task, int32_t min,
                                int32_t extent, uint8_t* closure);

/* Excludes other threads from updating the element. The holder must not wait for anything. */
void retrograde_lock_element(retrograde_context*, const void* element);
void retrograde_unlock_element(retrograde_context*, const void* element);

/* Runs both tasks with index 0: `first` on a thread of its own, which does not count towards thread limits. If one
 * fails, the semaphores are closed. Returns the code of a task that failed by itself; the first's if both did. */
int32_t retrograde_fork(retrograde_context*, retrograde_task first, uint8_t* first_closure,
                        retrograde_task rest, uint8_t* rest_closure, void** semaphores,
                        int32_t semaphore_count);
/* Counting semaphores in the caller's memory, aligned to 8 bytes. Acquire waits until the semaphore's value is at
 * least `count` and subtracts it. It returns 0, or an error code once the semaphore is closed. */
enum { retrograde_semaphore_bytes = 8 };
int32_t retrograde_semaphore_init(retrograde_context*, void* semaphore, int32_t count);
int32_t retrograde_semaphore_acquire(retrograde_context*, void* semaphore, int32_t count);
int32_t retrograde_semaphore_release(retrograde_context*, void* semaphore, int32_t count);

/* Allocates `elements` of `element_bytes` each, and at least one byte. Returns null if the count is negative, the
 * size overflows, or there is no memory. */
void* retrograde_allocate(retrograde_context*, int64_t elements, int64_t element_bytes);
/* Reports why retrograde_allocate returned null, and returns the error code. */
int32_t retrograde_allocation_error(retrograde_context*, const char* name, int64_t elements,
                                    int64_t element_bytes);
/* Null is allowed. */
void retrograde_free(retrograde_context*, void* block);
/* Frees the blocks that are not null, the last one first. */
void retrograde_free_all(retrograde_context*, void** blocks, int64_t count);

/* Reports an event and returns its number, which is unique in the process. */
int32_t retrograde_trace(retrograde_context*, const struct halide_trace_event_t* event);
/* The same from an event's parts: `event` is a halide_trace_event_code_t, `tag` may be null. */
int32_t retrograde_trace_region(retrograde_context*, const char* func, int32_t event,
                                int32_t parent, int32_t* coordinates, int32_t count,
                                const char* tag);
/* Reports a tag with the text `type` followed by the numbers of the region. */
int32_t retrograde_trace_type(retrograde_context*, const char* func, int32_t parent,
                              const char* type, const int32_t* region, int32_t count);
/* What retrograde_trace does without a handler: sends a line of text to the print handler or, if HL_TRACE_FILE is
 * set in the environment, writes a halide_trace_packet_t to that file. */
int32_t retrograde_default_trace(retrograde_context*, const struct halide_trace_event_t* event);

/* Writes a buffer to a .npy or .tmp file; see Func::debug_to_file. */
int32_t retrograde_debug_to_file(retrograde_context*, const char* path,
                                 const struct halide_buffer_t* buffer);

/* Checks that a function makes of its buffers; they report what is wrong and return its code. This one comes first,
 * for every buffer: it is not null, has elements of this type (halide_type_t as a number: code | bits << 8 | lanes
 * << 16) and this number of dimensions, and at most 2^31 - 1 elements. */
int32_t retrograde_check_shape(retrograde_context*, const struct halide_buffer_t* buffer,
                               const char* name, int32_t type, int32_t dimensions);
/* For each buffer that is not a bounds query: its data are on the host at a multiple of `alignment` bytes, its
 * offsets fit 31 bits, and it contains the used region. `used` has the first and last coordinate of each dimension
 * whose bit is set in `dimensions`. */
enum {
  retrograde_region_is_written = 1, /* else it is read */
  retrograde_region_is_dense = 2,   /* the stride of dimension 0 must be 1 */
  retrograde_region_on_device = 4   /* the pipeline has kernels: data may be on a device */
};
int32_t retrograde_check_region(retrograde_context*, const struct halide_buffer_t* buffer,
                                const char* name, int32_t rules, int32_t alignment,
                                int32_t dimensions, const int32_t* used);
/* Answers a bounds query: `sides` has min, extent and stride of each dimension. */
int32_t retrograde_answer_query(retrograde_context*, struct halide_buffer_t* buffer,
                                int32_t dimensions, const int32_t* sides);

/* The profiler. A run begins with the names of its Funcs, one per line; later calls refer to them by number. A null
 * run is not profiled. Each thread that works for a run gets a place, never null, in which generated code stores the
 * number of the current Func. A thread that gets another place for nested work does not compute in the earlier one
 * until it leaves the nested one. */
void* retrograde_profiler_begin(retrograde_context*, const char* pipeline, const char* funcs);
int32_t* retrograde_profiler_thread(retrograde_context*, void* run, int32_t func);
int32_t retrograde_profiler_leave(retrograde_context*, int32_t* place);
int32_t retrograde_profiler_memory(retrograde_context*, void* run, int32_t func, int64_t change);
int32_t retrograde_profiler_end(retrograde_context*, void* run);

/* The cache of memoized Funcs. Lookup copies `count` values to `blocks` of the given sizes and returns 0, or 1 if
 * the cache has no such entry. Store copies the values; it may also store nothing. */
int32_t retrograde_memoization_lookup(retrograde_context*, const uint8_t* key, int32_t key_bytes,
                                      int32_t count, void** blocks, const int64_t* bytes);
int32_t retrograde_memoization_store(retrograde_context*, const uint8_t* key, int32_t key_bytes,
                                     int32_t count, void* const* blocks, const int64_t* bytes,
                                     int32_t has_eviction_key, uint64_t eviction_key);

/* Reports an error and returns its code. Format fields are those of retrograde_format_message. */
int32_t retrograde_report_error(retrograde_context*, int32_t code, const char* format, ...);
void retrograde_print(retrograde_context*, const char* format, ...);

/* ---- only in the static runtime ---- */

/* Initialises the context for one call of an ahead-of-time compiled function: its handlers call the functions of
 * HalideRuntime.h with `user_context`. */
void retrograde_begin_call(retrograde_context*, void* user_context);

/* ---- for hosts ---- */

/* Writes at most `size` bytes, including the final 0, and returns the length written. Fields:
 *   %i int64_t   %u uint64_t   %f double, as the shortest text that reads back the same
 *   %F a float passed as double, with six decimals   %E double, scientific with six decimals
 *   %g as %f, for a float passed as double   %s const char *   %p const void *   %% a percent */
size_t retrograde_format_message(char* text, size_t size, const char* format, ...);

/* Name of an error code, or "unknown error". */
const char* retrograde_error_name(int32_t code);

/* The default allocator. Large blocks are kept after their release, because mapping and zeroing new pages costs more
 * than most stages of a pipeline. */
void* retrograde_pool_malloc(size_t bytes);
void retrograde_pool_free(void* block);
/* Limit on the bytes that released blocks may hold. Default: a quarter of the machine's memory. */
void retrograde_pool_set_limit(size_t bytes);
size_t retrograde_pool_bytes(void); /* held now */
void retrograde_pool_release(void); /* gives them all back to the system */

/* Limit on the bytes of memoized results; 0: the default, 1 MiB. */
void retrograde_memoization_set_size(int64_t bytes);
int64_t retrograde_memoization_bytes(void); /* held now */
/* Removes the entries that were stored with this eviction key. */
void retrograde_memoization_evict(uint64_t eviction_key);
void retrograde_memoization_cleanup(void); /* removes all entries */

/* Sends a table of all profiled pipelines to the print handler: time, threads and peak memory by Func. */
void retrograde_profiler_report(retrograde_context*);
/* The same as numbers, or null. Must not be read while the pipeline runs. */
struct halide_profiler_pipeline_stats* retrograde_profiler_pipeline(const char* name);
void retrograde_profiler_reset(void); /* clears all times and sizes */

#ifdef __cplusplus
}
#endif

#endif
