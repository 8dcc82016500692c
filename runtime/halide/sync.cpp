// Mutexes and condition variables by HalideRuntime.h; both are zero-initialised words.
#include <atomic>
#include <new>

#include "halide/weak.h"

namespace {

using Word = std::atomic_ref<uintptr_t>;
// A mutex is free, held, or held with sleeping waiters (Drepper, "Futexes are tricky", 2011).
constexpr uintptr_t is_free = 0, is_held = 1, is_awaited = 2;

Word word(halide_mutex* mutex) { return Word(mutex->_private[0]); }
Word word(halide_cond* cond) { return Word(cond->_private[0]); }

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
