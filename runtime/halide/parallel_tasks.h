// Between the tasks that wait for semaphores and the semaphores.
#pragma once

#include <HalideRuntime.h>

namespace retrograde::runtime {

// Wakes the tasks that wait.
void note_semaphore_release();

// Null stands for the default.
void set_semaphore_handlers(halide_semaphore_init_t init,
                            halide_semaphore_try_acquire_t try_acquire,
                            halide_semaphore_release_t release);

}  // namespace retrograde::runtime
