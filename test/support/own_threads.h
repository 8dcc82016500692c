// Runs parallel loops on a number of threads that does not depend on the machine, as a context for realize(). Threads
// take iterations in order, or in reverse order on request.
#pragma once

#include <atomic>
#include <thread>
#include <vector>

#include "frontend/run/jit_handlers.h"

namespace retrograde {

class OwnThreads : public JITUserContext {
 public:
  explicit OwnThreads(int threads, bool backward = false) : threads_(threads), backward_(backward) {
    handlers.custom_do_par_for = run;
  }
  // The number of parallel loops with more than one iteration that have run, and the largest number of iterations.
  int loops() const { return loops_; }
  int longest() const { return longest_; }

 private:
  // Nested loops run on the thread that reaches them.
  static int run(JITUserContext* context, JITTask task, int min, int extent, uint8_t* closure) {
    auto& self = static_cast<OwnThreads&>(*context);
    static thread_local int depth = 0;
    std::atomic<int> next{0}, result{0};
    auto work = [&] {
      ++depth;
      for (int i; (i = next++) < extent && result == 0;) {
        const int error = task(context, min + (self.backward_ ? extent - 1 - i : i), closure);
        if (error != 0) result = error;
        std::this_thread::yield();
      }
      --depth;
    };
    std::vector<std::thread> others;
    const int wanted = depth == 0 ? std::min(self.threads_, extent) : 1;
    for (int t = 1; t < wanted; ++t) others.emplace_back(work);
    work();
    for (std::thread& t : others) t.join();
    self.note(extent);
    return result;
  }
  void note(int extent) {
    if (extent < 2) return;
    ++loops_;
    int before = longest_;
    while (before < extent && !longest_.compare_exchange_weak(before, extent)) {
    }
  }

  const int threads_;
  const bool backward_;
  std::atomic<int> loops_{0}, longest_{0};
};

}  // namespace retrograde
