/* simt_driver.h -- the simulated device: CUDA's driver functions over kernels that were compiled for
 * this machine, for tests without a GPU, and for finding what a GPU would not tell.
 *
 * libretrograde_simt.so exports the functions of libcuda.so.1 that the runtime uses, under their
 * versioned names; RETROGRADE_GPU=simulated makes the runtime open it instead. A kernel's threads run in
 * an order of choice, one fiber for each where they wait for one another. Errors of a program are
 * errors of the driver, whose text says what was found:
 *
 * - two threads that access the same bytes, one of them writing, with no barrier between them (but for
 *   atomics, and for stores of the value that is there already);
 * - barriers that not all threads reach, or not the same one; shuffles that not all lanes reach;
 * - accesses outside of live allocations, or of the block's shared memory.
 *
 * Not found: what barriers do not order on a device although they do here, uses of uninitialized memory
 * (it starts as bytes of 0xff, which are NaN), and faults of alignment.
 *
 * Work on streams runs when somebody waits for it, and streams overtake one another as they may. Capture
 * refuses what it refuses on a device. What the names below set is also set by the environment:
 *   RETROGRADE_SIMT_ORDER      forward, reverse, random, warp_ahead
 *   RETROGRADE_SIMT_SEED       of all that is random
 *   RETROGRADE_SIMT_DEVICES    how many there are (1)
 *   RETROGRADE_SIMT_MEMORY     bytes of each (2^30)
 *   RETROGRADE_SIMT_RACES      0: accesses are not compared (1)
 *   RETROGRADE_SIMT_PROFILE    1: accesses are counted (0)
 *   RETROGRADE_SIMT_IN_ORDER   1: work runs in the order that it was asked for (0)
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
/* For what is launched and allocated from now on. */
void retrograde_simt_set_options(const retrograde_simt_options*);

/* ---- failures ---- */

/* The functions that are there, and how often each was called; null: behind the last one. */
const char* retrograde_simt_function(int32_t index);
int64_t retrograde_simt_call_count(const char* function);
/* The nth call from now (1: the next one) of this function, or of any for null, fails with the CUresult
 * and does nothing. "kernel" is the run of a kernel itself, after which its context is lost. */
void retrograde_simt_fail_call(const char* function, int64_t nth, int32_t result);
/* Failures that have not come yet are called off; gives how many there were. */
int32_t retrograde_simt_call_off(void);
/* All contexts of the device fail from now on, until they are made anew. */
void retrograde_simt_lose_device(int32_t number);
/* What was last found wrong in a kernel; "" for nothing. Valid until this thread asks again. */
const char* retrograde_simt_last_finding(void);

/* ---- what is there ---- */

typedef struct retrograde_simt_live {
  int64_t contexts, modules, allocations, allocated_bytes, streams, events, graphs;
  int64_t pending; /* operations that have not run yet */
} retrograde_simt_live;
void retrograde_simt_count_live(retrograde_simt_live*);

/* Bytes of all copies that were asked for so far. */
typedef struct retrograde_simt_copied {
  int64_t to_device, to_host, between_devices;
} retrograde_simt_copied;
void retrograde_simt_count_copied(retrograde_simt_copied*);

/* ---- the profile ---- */

/* Sums over launches of a kernel. A warp request is what the threads of a warp access by one
 * statement at one time. */
typedef struct retrograde_simt_profile {
  int64_t launches, blocks, threads;
  int64_t barriers, warp_barriers, shuffles; /* of blocks, of warps, of warps */
  int64_t global_requests, global_bytes;     /* bytes: as the threads asked for them */
  int64_t global_sectors, ideal_sectors;     /* of 32 bytes; ideal: had the bytes been dense */
  int64_t load_sectors, store_sectors, atomic_sectors;
  int64_t shared_requests, shared_bytes;
  int64_t bank_conflicts; /* passes over the banks beyond those that are always needed */
} retrograde_simt_profile;
/* Of a kernel, or of all for null; false where it was never launched while profiling. */
int32_t retrograde_simt_get_profile(const char* kernel, retrograde_simt_profile*);
void retrograde_simt_reset_profile(void);

#ifdef __cplusplus
}
#endif

#endif
