// Mutexes, condition variables and semaphores by HalideRuntime.h; all are zero-initialised words.
#include <atomic>
#include <new>

#include "halide/parallel_tasks.h"
#include "halide/weak.h"

namespace {

using Word = std::atomic_ref<uintptr_t>;
// A mutex is free, held, or held with sleeping waiters (Drepper, "Futexes are tricky", 2011).
constexpr uintptr_t is_free = 0, is_held = 1, is_awaited = 2;

Word word(halide_mutex* mutex) { return Word(mutex->_private[0]); }
Word word(halide_cond* cond) { return Word(cond->_private[0]); }
std::atomic_ref<uint64_t> word(halide_semaphore_t* semaphore) {
  return std::atomic_ref<uint64_t>(semaphore->_private[0]);
}

std::atomic<halide_semaphore_init_t> init_handler{halide_default_semaphore_init};
std::atomic<halide_semaphore_try_acquire_t> try_acquire_handler{
    halide_default_semaphore_try_acquire};
std::atomic<halide_semaphore_release_t> release_handler{halide_default_semaphore_release};

}  // namespace

RETROGRADE_WEAK void halide_mutex_lock(halide_mutex* mutex) {
  uintptr_t state = is_free;
  if (word(mutex).compare_exchange_strong(state, is_held, std::memory_order_acquire)) return;
  while (word(mutex).exchange(is_awaited, std::memory_order_acquire) != is_free)
    word(mutex).wait(is_awaited, std::memory_order_relaxed);
}
RETROGRADE_WEAK void halide_mutex_unlock(halide_mutex* mutex) {
  if (word(mutex).exchange(is_free, std::memory_order_release) == is_awaited)
    word(mutex).notify_one();
}

// A condition variable counts its signals: a waiter sleeps while the count equals the one that it read under the mutex.
RETROGRADE_WEAK void halide_cond_signal(halide_cond* cond) {
  word(cond).fetch_add(1, std::memory_order_release);
  word(cond).notify_one();
}
RETROGRADE_WEAK void halide_cond_broadcast(halide_cond* cond) {
  word(cond).fetch_add(1, std::memory_order_release);
  word(cond).notify_all();
}
RETROGRADE_WEAK void halide_cond_wait(halide_cond* cond, halide_mutex* mutex) {
  const uintptr_t seen = word(cond).load(std::memory_order_acquire);
  halide_mutex_unlock(mutex);
  word(cond).wait(seen, std::memory_order_acquire);
  halide_mutex_lock(mutex);
}

struct halide_mutex_array {
  halide_mutex* mutexes;
};

RETROGRADE_WEAK halide_mutex_array* halide_mutex_array_create(int size) {
  auto* array = new (std::nothrow) halide_mutex_array{};
  if (array) array->mutexes = new (std::nothrow) halide_mutex[static_cast<size_t>(size)]();
  if (array && !array->mutexes) {
    delete array;
    return nullptr;
  }
  return array;
}
RETROGRADE_WEAK void halide_mutex_array_destroy(void*, void* data) {
  auto* array = static_cast<halide_mutex_array*>(data);
  delete[] array->mutexes;
  delete array;
}
RETROGRADE_WEAK int halide_mutex_array_lock(halide_mutex_array* array, int entry) {
  halide_mutex_lock(&array->mutexes[entry]);
  return 0;
}
RETROGRADE_WEAK int halide_mutex_array_unlock(halide_mutex_array* array, int entry) {
  halide_mutex_unlock(&array->mutexes[entry]);
  return 0;
}

RETROGRADE_WEAK int halide_default_semaphore_init(halide_semaphore_t* semaphore, int count) {
  word(semaphore).store(static_cast<uint64_t>(count));
  return count;
}
RETROGRADE_WEAK int halide_default_semaphore_release(halide_semaphore_t* semaphore, int count) {
  const int before = static_cast<int>(word(semaphore).fetch_add(static_cast<uint64_t>(count)));
  retrograde::runtime::note_semaphore_release();
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
  retrograde::runtime::note_semaphore_release();
  return now;
}
RETROGRADE_WEAK bool halide_semaphore_try_acquire(halide_semaphore_t* semaphore, int count) {
  return try_acquire_handler.load()(semaphore, count);
}

void retrograde::runtime::set_semaphore_handlers(halide_semaphore_init_t init,
                                                 halide_semaphore_try_acquire_t try_acquire,
                                                 halide_semaphore_release_t release) {
  init_handler = init ? init : halide_default_semaphore_init;
  try_acquire_handler = try_acquire ? try_acquire : halide_default_semaphore_try_acquire;
  release_handler = release ? release : halide_default_semaphore_release;
}
