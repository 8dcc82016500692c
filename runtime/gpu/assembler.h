/* assembler.h -- lets a program supply machine code for PTX, instead of the driver's own compiler. A program may
 * have one assembler. Its code is loaded in place of the PTX. If it supplies none, or code that the driver rejects,
 * the driver compiles the PTX. */
#ifndef RETROGRADE_GPU_ASSEMBLER_H
#define RETROGRADE_GPU_ASSEMBLER_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

struct retrograde_assembler_request {
  const char* ptx;
  uint64_t ptx_bytes;
  int32_t capability;     /* of the device; 90: 9.0 */
  int32_t driver_version; /* 12040: of CUDA 12.4 */
};
/* Calls `use` with the machine code before it returns, or does not call it. Called from any thread; must not throw. */
typedef void (*retrograde_assembler)(const struct retrograde_assembler_request*,
                                     void (*use)(void* closure, const void* code, size_t bytes),
                                     void* closure);
/* Sets the assembler; null removes it. `is_simulated`: also use it for the simulated device, which otherwise loads
 * its own images (gpu_image.h). */
void retrograde_set_assembler(retrograde_assembler, int32_t is_simulated);

#ifdef __cplusplus
}
#endif

#endif
