// OwnThreads that also measures the allocations of compiled code.
#pragma once

#include <atomic>
#include <cstdlib>

#include "support/own_threads.h"

namespace retrograde {

class MeasuredThreads : public OwnThreads {
 public:
  explicit MeasuredThreads(int threads, bool backward = false) : OwnThreads(threads, backward) {
    handlers.custom_malloc = allocate;
    handlers.custom_free = release;
  }
  int64_t peak_bytes() const { return peak_; }
  int64_t bytes() const { return now_; }  // bytes still allocated

 private:
  static constexpr size_t alignment =
      128;  // the runtime's own alignment; the size is stored before the block

  static void* allocate(JITUserContext* context, size_t size) {
    auto& self = static_cast<MeasuredThreads&>(*context);
    const size_t all = (size + 2 * alignment - 1) / alignment * alignment;
    auto* memory = static_cast<char*>(std::aligned_alloc(alignment, all));
    if (!memory) return nullptr;
    *reinterpret_cast<size_t*>(memory) = size;
    const int64_t now = self.now_ += static_cast<int64_t>(size);
    int64_t peak = self.peak_;
    while (peak < now && !self.peak_.compare_exchange_weak(peak, now)) {
    }
    return memory + alignment;
  }
  static void release(JITUserContext* context, void* pointer) {
    if (!pointer) return;
    auto& self = static_cast<MeasuredThreads&>(*context);
    char* memory = static_cast<char*>(pointer) - alignment;
    self.now_ -= static_cast<int64_t>(*reinterpret_cast<size_t*>(memory));
    std::free(memory);
  }

  std::atomic<int64_t> now_{0}, peak_{0};
};

}  // namespace retrograde
