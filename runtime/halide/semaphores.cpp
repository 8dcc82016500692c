// Semaphores by HalideRuntime.h; a semaphore is a zero-initialised word.
#include "halide/semaphores.h"

#include <atomic>

#include "halide/weak.h"

namespace {

namespace rt = retrograde::runtime;

std::atomic_ref<uint64_t> word(halide_semaphore_t* semaphore) {
  return std::atomic_ref<uint64_t>(semaphore->_private[0]);
}

std::atomic<halide_semaphore_init_t> init_handler{halide_default_semaphore_init};
std::atomic<halide_semaphore_try_acquire_t> try_acquire_handler{
    halide_default_semaphore_try_acquire};
std::atomic<halide_semaphore_release_t> release_handler{halide_default_semaphore_release};

// Counts events that may end a wait.
std::atomic<uint32_t> wakes{0};

}  // namespace

uint32_t rt::wake_count() { return wakes.load(); }
void rt::wait_for_wake(uint32_t seen) { wakes.wait(seen); }
void rt::wake_waiting_tasks() {
  wakes.fetch_add(1);
  wakes.notify_all();
}

RETROGRADE_WEAK int halide_default_semaphore_init(halide_semaphore_t* semaphore, int count) {
  word(semaphore).store(static_cast<uint64_t>(count));
  return count;
}
RETROGRADE_WEAK int halide_default_semaphore_release(halide_semaphore_t* semaphore, int count) {
  const int before = static_cast<int>(word(semaphore).fetch_add(static_cast<uint64_t>(count)));
  rt::wake_waiting_tasks();
  return before + count;
}
RETROGRADE_WEAK bool halide_default_semaphore_try_acquire(halide_semaphore_t* semaphore,
                                                          int count) {
  uint64_t has = word(semaphore).load();
  do {
    if (has < static_cast<uint64_t>(count)) return false;
  } while (!word(semaphore).compare_exchange_weak(has, has - static_cast<uint64_t>(count)));
  return true;
}
RETROGRADE_WEAK int halide_semaphore_init(halide_semaphore_t* semaphore, int count) {
  return init_handler.load()(semaphore, count);
}
RETROGRADE_WEAK int halide_semaphore_release(halide_semaphore_t* semaphore, int count) {
  const int now = release_handler.load()(semaphore, count);
  rt::wake_waiting_tasks();
  return now;
}
RETROGRADE_WEAK bool halide_semaphore_try_acquire(halide_semaphore_t* semaphore, int count) {
  return try_acquire_handler.load()(semaphore, count);
}

void rt::set_semaphore_handlers(halide_semaphore_init_t init,
                                halide_semaphore_try_acquire_t try_acquire,
                                halide_semaphore_release_t release) {
  init_handler = init ? init : halide_default_semaphore_init;
  try_acquire_handler = try_acquire ? try_acquire : halide_default_semaphore_try_acquire;
  release_handler = release ? release : halide_default_semaphore_release;
}
