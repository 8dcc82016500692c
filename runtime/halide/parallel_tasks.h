// Interface between semaphores and the tasks that wait for them.
#pragma once

#include <HalideRuntime.h>

namespace retrograde::runtime {

// Wakes the waiting tasks.
void note_semaphore_release();

// Null restores the default.
void set_semaphore_handlers(halide_semaphore_init_t init,
                            halide_semaphore_try_acquire_t try_acquire,
                            halide_semaphore_release_t release);

}  // namespace retrograde::runtime
