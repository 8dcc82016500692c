/* gpu_image.h -- the form in which the compiler passes kernels to the runtime: PTX for devices and, for the
 * simulated device (simt_driver.h), the same kernels compiled for this machine.
 *
 * Each call of a compiled kernel runs one thread of a block. Operations that a processor lacks are calls: barriers,
 * shuffles, and a notification before every memory access. From these, the simulated device detects races and
 * accesses outside of allocations, and counts memory transactions. */
#ifndef RETROGRADE_GPU_IMAGE_H
#define RETROGRADE_GPU_IMAGE_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

struct retrograde_simt_thread;

enum { retrograde_simt_load = 0, retrograde_simt_store = 1, retrograde_simt_atomic = 2 };
enum { retrograde_simt_global = 0, retrograde_simt_shared = 1, retrograde_simt_local = 2 };
enum {
  retrograde_simt_index = 0, /* the value of lane `lane` */
  retrograde_simt_up = 1,    /* of the lane `lane` below; below lane 0: the own value */
  retrograde_simt_down = 2,  /* of the lane `lane` above; above lane 31: the own value */
  retrograde_simt_xor = 3    /* of the own lane xor `lane` */
};

/* Functions that a kernel calls. `site` indexes the kernel's table of statements; -1: unknown. */
struct retrograde_simt_calls {
  /* Barriers for all threads of the block, and for those of a warp (32 threads, x innermost). */
  void (*barrier)(struct retrograde_simt_thread*, int32_t site);
  void (*warp_barrier)(struct retrograde_simt_thread*, int32_t site);
  /* All threads of the warp must take part. */
  uint32_t (*shuffle)(struct retrograde_simt_thread*, uint32_t value, int32_t lane, int32_t kind,
                      int32_t site);
  /* Called before every load and store, once for each contiguous access of a thread. */
  void (*access)(struct retrograde_simt_thread*, const void* address, int32_t bytes, int32_t kind,
                 int32_t space, int32_t site);
};

/* Compiled kernels read these fields at these offsets; the simulated device keeps its own data after them. */
struct retrograde_simt_thread {
  const struct retrograde_simt_calls* calls;
  uint8_t* shared; /* the block's shared memory */
  int32_t block[3], thread[3];
  int32_t blocks[3], threads[3]; /* extents */
};

/* args: the argument memory, each argument at its natural alignment, in order; a buffer is its device address. */
typedef void (*retrograde_simt_kernel)(struct retrograde_simt_thread*, const uint8_t* args);

struct retrograde_gpu_kernel {
  const char* name;
  retrograde_simt_kernel simt; /* null if the image has only PTX */
  int32_t suspends;            /* 1 if it has barriers or shuffles */
  int32_t num_args;
  const int32_t* arg_bytes;
  int32_t num_sites;
  const char* const* sites; /* the statements as IR text */
};

/* "RGPUIMG1", with which no PTX begins. */
#define RETROGRADE_GPU_IMAGE_MAGIC UINT64_C(0x31474d4955504752)

struct retrograde_gpu_image {
  uint64_t magic;
  uint64_t ptx_bytes; /* 0 if the image is only for the simulated device */
  const char* ptx;    /* zero-terminated; ptx_bytes does not count the 0 */
  int32_t num_kernels;
  const struct retrograde_gpu_kernel* kernels;
};

#ifdef __cplusplus
}
#endif

#endif
