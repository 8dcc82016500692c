/* simt_driver.h -- the simulated device: implements CUDA's driver functions for kernels that were compiled for this
 * machine. It serves tests without a GPU, and detects errors that a GPU would not report.
 *
 * libretrograde_simt.so exports the functions of libcuda.so.1 that the runtime uses, under their versioned names.
 * RETROGRADE_GPU=simulated makes the runtime open it instead. A kernel's threads run in a selectable order; threads
 * that wait for one another run as fibers. Errors of a program become errors of the driver, whose text says what was
 * found:
 *
 * - two threads that access the same bytes, one of them writing, with no barrier between them (except
 *   atomics, and stores of the value that is already there);
 * - barriers that not all threads reach, or not the same one; shuffles that not all lanes reach;
 * - accesses outside of live allocations, or of the block's shared memory.
 *
 * Not found: accesses that barriers order here but not on a real device, uses of uninitialised memory (which starts
 * as bytes of 0xff, which are NaN), and misaligned accesses.
 *
 * Work on streams runs only when something waits for it, and streams overtake one another wherever they may. Graph
 * capture rejects the same calls as on a real device. The options below can also be set in the environment:
 *   RETROGRADE_SIMT_ORDER      forward, reverse, random, warp_ahead
 *   RETROGRADE_SIMT_SEED       of all random choices
 *   RETROGRADE_SIMT_DEVICES    number of devices (1)
 *   RETROGRADE_SIMT_MEMORY     bytes of memory of each (2^30)
 *   RETROGRADE_SIMT_RACES      0: no race detection (1)
 *   RETROGRADE_SIMT_PROFILE    1: accesses are counted (0)
 *   RETROGRADE_SIMT_IN_ORDER   1: work runs in the order in which it was enqueued (0)
 *   RETROGRADE_SIMT_FAIL       function:nth:result,... as retrograde_simt_fail_call */
#ifndef RETROGRADE_SIMT_DRIVER_H
#define RETROGRADE_SIMT_DRIVER_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum retrograde_simt_order {
  retrograde_simt_forward = 0,
  retrograde_simt_reverse = 1,
  retrograde_simt_random = 2,
  retrograde_simt_warp_ahead = 3 /* one warp, another one each time, runs as far as it can */
};

typedef struct retrograde_simt_options {
  int32_t order;
  uint64_t seed;
  int32_t devices;
  size_t memory_bytes; /* of each */
  int32_t find_races;
  int32_t profile;
  int32_t in_order;
} retrograde_simt_options;
void retrograde_simt_get_options(retrograde_simt_options*);
/* Applies to later launches and allocations. */
void retrograde_simt_set_options(const retrograde_simt_options*);

/* ---- failures ---- */

/* The functions of the driver, null after the last one, and how often each was called. */
const char* retrograde_simt_function(int32_t index);
int64_t retrograde_simt_call_count(const char* function);
/* Makes the nth call from now (1: the next one) of this function, or of any function if null, fail with this
 * CUresult and do nothing. "kernel" means the run of a kernel itself, after which its context is lost. */
void retrograde_simt_fail_call(const char* function, int64_t nth, int32_t result);
/* Cancels the failures that have not happened yet; returns how many there were. */
int32_t retrograde_simt_call_off(void);
/* Makes all contexts of the device fail until they are created anew. */
void retrograde_simt_lose_device(int32_t number);
/* The last error found in a kernel; "" if there is none. Valid until this thread calls it again. */
const char* retrograde_simt_last_finding(void);

/* ---- live objects ---- */

typedef struct retrograde_simt_live {
  int64_t contexts, modules, allocations, allocated_bytes, streams, events, graphs;
  int64_t pending; /* operations that have not run yet */
} retrograde_simt_live;
void retrograde_simt_count_live(retrograde_simt_live*);

/* Bytes of all copies that were requested so far. */
typedef struct retrograde_simt_copied {
  int64_t to_device, to_host, between_devices;
} retrograde_simt_copied;
void retrograde_simt_count_copied(retrograde_simt_copied*);

/* ---- the profile ---- */

/* Totals over the launches of a kernel. A warp request is the set of accesses that the threads of a warp make by one
 * statement at one time. */
typedef struct retrograde_simt_profile {
  int64_t launches, blocks, threads;
  int64_t barriers, warp_barriers, shuffles; /* of blocks, of warps, of warps */
  int64_t global_requests, global_bytes;     /* bytes: as threads requested them */
  int64_t global_sectors, ideal_sectors;     /* of 32 bytes; ideal: if the bytes were contiguous */
  int64_t load_sectors, store_sectors, atomic_sectors;
  int64_t shared_requests, shared_bytes;
  int64_t bank_conflicts; /* passes over the banks beyond those that are always needed */
} retrograde_simt_profile;
/* The totals of a kernel, or of all kernels if null. Returns false if it was never launched while profiling. */
int32_t retrograde_simt_get_profile(const char* kernel, retrograde_simt_profile*);
void retrograde_simt_reset_profile(void);

#ifdef __cplusplus
}
#endif

#endif
