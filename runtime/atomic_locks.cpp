// Locks for elements that no instruction updates atomically: Tuples, and elements above 64 bits.
//
// There is a fixed number of spin locks, chosen by a hash of the address: two elements may share a lock, and one
// element always has the same lock. A holder computes and stores a few values and waits for nothing. So spinning is
// appropriate, and deadlocks are impossible.
#include <atomic>
#include <cstdint>
#include <thread>

#include "retrograde_runtime.h"
#include "spin.h"

namespace retrograde::runtime {
namespace {

constexpr int lock_bits = 10;

struct alignas(64) SpinLock {
  std::atomic<bool> is_taken{false};

  void take() {
    for (int spins = 0; is_taken.exchange(true, std::memory_order_acquire);) {
      while (is_taken.load(std::memory_order_relaxed)) {
        if (++spins % 64 == 0) std::this_thread::yield();  // its holder may not be running
        spin_pause();
      }
    }
  }
  void release() { is_taken.store(false, std::memory_order_release); }
};

SpinLock locks[1 << lock_bits];

SpinLock& lock_of(const void* element) {
  const uint64_t mixed = (reinterpret_cast<uintptr_t>(element) >> 2) * 0x9e3779b97f4a7c15u;
  return locks[mixed >> (64 - lock_bits)];
}

}  // namespace
}  // namespace retrograde::runtime

void retrograde_lock_element(retrograde_context*, const void* element) {
  retrograde::runtime::lock_of(element).take();
}

void retrograde_unlock_element(retrograde_context*, const void* element) {
  retrograde::runtime::lock_of(element).release();
}
