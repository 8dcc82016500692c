// How tasks wait for semaphores.
//
// A task that could not acquire its semaphore sleeps until any semaphore is released or any task fails, and tries
// again. To miss no event, it reads the count of wakes before it tries.
#pragma once

#include <HalideRuntime.h>

namespace retrograde::runtime {

uint32_t wake_count();
// Sleeps while the count of wakes is `seen`.
void wait_for_wake(uint32_t seen);
void wake_waiting_tasks();

// Null restores the default.
void set_semaphore_handlers(halide_semaphore_init_t init,
                            halide_semaphore_try_acquire_t try_acquire,
                            halide_semaphore_release_t release);

}  // namespace retrograde::runtime
