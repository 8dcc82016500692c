// Parallel loops. The result is deterministic: the code of the lowest failing iteration.
//
// Proof: an iteration is skipped only if a lower one has failed. So the lowest of all failing iterations is never
// skipped, and no other iteration can replace it.
#include <atomic>
#include <mutex>

#include "parallel.h"
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
  // Called after the loop.
  int32_t report_to(const ParallelLoop& loop) {
    const std::lock_guard lock(mutex_);
    if (code_ != 0 && failure_.message[0]) loop.report(loop.data, code_, failure_.message);
    return code_;
  }

 private:
  std::atomic<int64_t> lowest_{INT64_MAX};
  std::mutex mutex_;
  int32_t code_ = 0;
  Failure failure_;
};

class Run {
 public:
  explicit Run(const ParallelLoop& loop) : loop_(loop) {}

  int32_t all() {
    fence_.store(1, std::memory_order_release);
    const auto run_part = [](void* run, int64_t begin, int64_t end) {
      static_cast<Run*>(run)->range(begin, end);
    };
    run_on_threads(loop_.extent, loop_.thread_limit, run_part, this);
    fence_.load(std::memory_order_acquire);
    return failures_.report_to(loop_);
  }

 private:
  const ParallelLoop& loop_;
  LowestFailure failures_;
  // Iterations see what the caller wrote before the loop, and the caller sees their writes after it. The threading
  // library guarantees this already; the fence makes it visible to race detectors.
  std::atomic<int> fence_{0};

  void one(int64_t iteration) {
    if (failures_.skips(iteration)) return;
    Failure failure;
    int32_t code = 0;
    {
      const FailureScope scope(&failure);
      code = loop_.run(loop_.data, static_cast<int32_t>(loop_.min + iteration));
    }
    if (code != 0) failures_.add(iteration, code, failure);
  }

  void range(int64_t begin, int64_t end) {
    fence_.load(std::memory_order_acquire);
    for (int64_t i = begin; i < end; i++) one(i);
    fence_.fetch_add(1, std::memory_order_release);
  }
};

// The arguments of one call of retrograde_parallel_for.
struct Tasks {
  retrograde_context* context;
  retrograde_task task;
  uint8_t* closure;
};

}  // namespace

int32_t run_parallel_loop(const ParallelLoop& loop) {
  if (loop.extent <= 0) return 0;
  try {
    return Run(loop).all();
  } catch (...) {  // the thread pool could not start: no memory or no threads
    char message[max_message_bytes];
    retrograde_format_message(message, sizeof message,
                              "cannot run a parallel loop of %i iterations: the thread pool has "
                              "no memory or threads left",
                              static_cast<int64_t>(loop.extent));
    loop.report(loop.data, retrograde_error_out_of_memory, message);
    return retrograde_error_out_of_memory;
  }
}

}  // namespace retrograde::runtime

int32_t retrograde_parallel_for(retrograde_context* context, retrograde_task task, int32_t min,
                                int32_t extent, uint8_t* closure) {
  using namespace retrograde::runtime;
  if (context && context->parallel_handler)
    return context->parallel_handler(context, task, min, extent, closure);
  Tasks tasks{context, task, closure};
  const auto run = [](void* data, int32_t index) {
    const Tasks& tasks = *static_cast<Tasks*>(data);
    retrograde_context* context = tasks.context;
    return context && context->task_handler
               ? context->task_handler(context, tasks.task, index, tasks.closure)
               : tasks.task(context, index, tasks.closure);
  };
  const auto tell = [](void* data, int32_t code, const char* message) {
    report(static_cast<Tasks*>(data)->context, code, message);
  };
  return run_parallel_loop({min, extent, context ? context->thread_limit : 0, &tasks, run, tell});
}
