// Parallel loops on oneTBB. The result is deterministic: the code of the lowest failing iteration.
//
// Why every lower iteration runs: an iteration is skipped only when one below it has failed, so the
// lowest of all failing iterations is never skipped, and no other can take its place.
#include <atomic>
#include <mutex>

#include "report.h"
#include "threads.h"

namespace retrograde::runtime {
namespace {

// The lowest failing iteration of one loop, counted from 0.
class LowestFailure {
 public:
  bool skips(int64_t iteration) const {
    return iteration > lowest_.load(std::memory_order_relaxed);
  }
  void add(int64_t iteration, int32_t code, const Failure& failure) {
    const std::lock_guard lock(mutex_);
    if (iteration >= lowest_.load(std::memory_order_relaxed)) return;
    lowest_.store(iteration, std::memory_order_relaxed);
    code_ = code;
    failure_ = failure;
  }
  // After the loop: tells the handler, or the loop around this one.
  int32_t report_to(retrograde_context* context) {
    const std::lock_guard lock(mutex_);
    if (code_ != 0 && failure_.message[0]) report(context, code_, failure_.message);
    return code_;
  }

 private:
  std::atomic<int64_t> lowest_{INT64_MAX};
  std::mutex mutex_;
  int32_t code_ = 0;
  Failure failure_;
};

struct Loop {
  retrograde_context* context;
  retrograde_task task;
  int32_t min, extent;
  uint8_t* closure;
  LowestFailure failures;
  // What the caller wrote before the loop is seen by the iterations, and what they wrote is seen
  // after it. TBB orders them as well; here it stands where a race detector can see it.
  std::atomic<int> fence{0};

  void run(int64_t iteration) {
    if (failures.skips(iteration)) return;
    Failure failure;
    int32_t code = 0;
    {
      const FailureScope scope(&failure);
      code = task(context, static_cast<int32_t>(min + iteration), closure);
    }
    if (code != 0) failures.add(iteration, code, failure);
  }

  void run_range(int64_t begin, int64_t end) {
    fence.load(std::memory_order_acquire);
    for (int64_t i = begin; i < end; i++) run(i);
    fence.fetch_add(1, std::memory_order_release);
  }

  int32_t run_all() {
    fence.store(1, std::memory_order_release);
    const auto run_part = [](void* loop, int64_t begin, int64_t end) {
      static_cast<Loop*>(loop)->run_range(begin, end);
    };
    run_on_threads(extent, context ? context->thread_limit : 0, run_part, this);
    fence.load(std::memory_order_acquire);
    return failures.report_to(context);
  }
};

}  // namespace
}  // namespace retrograde::runtime

int32_t retrograde_parallel_for(retrograde_context* context, retrograde_task task, int32_t min,
                                int32_t extent, uint8_t* closure) {
  using retrograde::runtime::Loop;
  if (extent <= 0) return 0;
  try {
    Loop loop{context, task, min, extent, closure, {}, {}};
    return loop.run_all();
  } catch (...) {  // TBB could not start: no memory or no threads
    return retrograde_report_error(
        context, retrograde_error_out_of_memory,
        "cannot run a parallel loop of %i iterations: the thread pool has "
        "no memory or threads left",
        static_cast<int64_t>(extent));
  }
}
