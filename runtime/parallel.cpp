// Parallel loops on oneTBB. The result is deterministic: the code of the lowest failing iteration.
//
// Why every lower iteration runs: an iteration is skipped only when one below it has failed, so the
// lowest of all failing iterations is never skipped, and no other can take its place.
#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <atomic>
#include <map>
#include <memory>
#include <mutex>

#include "report.h"

namespace retrograde::runtime {
namespace {

// The lowest failing iteration of one loop, counted from 0.
class LowestFailure {
 public:
  bool skips(int64_t iteration) const {
    return iteration > lowest_.load(std::memory_order_relaxed);
  }
  void add(int64_t iteration, int32_t code, const Failure &failure) {
    const std::lock_guard lock(mutex_);
    if (iteration >= lowest_.load(std::memory_order_relaxed)) return;
    lowest_.store(iteration, std::memory_order_relaxed);
    code_ = code;
    failure_ = failure;
  }
  // After the loop: tells the handler, or the loop around this one.
  int32_t report_to(retrograde_context *context) {
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
  retrograde_context *context;
  retrograde_task task;
  int32_t min, extent;
  uint8_t *closure;
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

  void run_parallel() {
    // Grain 1 and TBB's auto partitioner: iterations are rows or tiles, each worth far more than a
    // task; ranges split further only where a thread runs dry.
    fence.store(1, std::memory_order_release);
    tbb::parallel_for(tbb::blocked_range<int64_t>(0, extent),
                      [this](const tbb::blocked_range<int64_t> &range) {
                        run_range(range.begin(), range.end());
                      });
    fence.load(std::memory_order_acquire);
  }
};

// Arenas cost threads' attention to create, so there is one for each limit ever asked for.
tbb::task_arena &arena_of(int32_t thread_limit) {
  static std::mutex mutex;
  static auto &arenas = *new std::map<int32_t, std::unique_ptr<tbb::task_arena>>;  // outlives TBB
  const std::lock_guard lock(mutex);
  auto &arena = arenas[thread_limit];
  if (!arena) arena = std::make_unique<tbb::task_arena>(thread_limit);
  return *arena;
}

void run_limited(Loop &loop, int32_t thread_limit) {
  if (thread_limit == 1 || loop.extent == 1) {
    loop.run_range(0, loop.extent);
  } else if (thread_limit <= 0 || tbb::this_task_arena::max_concurrency() <= thread_limit) {
    loop.run_parallel();
  } else {
    arena_of(thread_limit).execute([&] { loop.run_parallel(); });
  }
}

}  // namespace
}  // namespace retrograde::runtime

int32_t retrograde_parallel_for(retrograde_context *context, retrograde_task task, int32_t min,
                                int32_t extent, uint8_t *closure) {
  using retrograde::runtime::Loop;
  if (extent <= 0) return 0;
  try {
    Loop loop{context, task, min, extent, closure, {}, {}};
    retrograde::runtime::run_limited(loop, context ? context->thread_limit : 0);
    return loop.failures.report_to(context);
  } catch (...) {  // TBB could not start: no memory or no threads
    return retrograde_report_error(context, retrograde_error_out_of_memory,
                                   "cannot run a parallel loop of %i iterations: the thread pool has "
                                   "no memory or threads left",
                                   static_cast<int64_t>(extent));
  }
}
