// Hides oneTBB behind one function. This file is compiled without the race detector: TBB's library is not built for it,
// so its templates would give false reports. parallel.cpp makes the order that TBB guarantees visible to the detector.
#include "threads.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <map>
#include <memory>
#include <mutex>

namespace retrograde::runtime {
namespace {

using Run = void (*)(void*, int64_t, int64_t);

void run_parallel(int64_t extent, Run run, void* data) {
  // Grain 1 and TBB's auto partitioner: iterations are rows or tiles, each worth far more than a task. Ranges are split
  // further only when a thread runs out of work.
  tbb::parallel_for(
      tbb::blocked_range<int64_t>(0, extent),
      [=](const tbb::blocked_range<int64_t>& range) { run(data, range.begin(), range.end()); });
}

// Creating an arena for each loop would be too expensive, so there is one for each limit ever used.
tbb::task_arena& arena_of(int32_t thread_limit) {
  static std::mutex mutex;
  static auto& arenas = *new std::map<int32_t, std::unique_ptr<tbb::task_arena>>;  // outlives TBB
  const std::lock_guard lock(mutex);
  auto& arena = arenas[thread_limit];
  if (!arena) arena = std::make_unique<tbb::task_arena>(thread_limit);
  return *arena;
}

}  // namespace

void run_on_threads(int64_t extent, int32_t thread_limit, Run run, void* data) {
  if (thread_limit == 1 || extent == 1) {
    run(data, 0, extent);
  } else if (thread_limit <= 0 || tbb::this_task_arena::max_concurrency() <= thread_limit) {
    run_parallel(extent, run, data);
  } else {
    arena_of(thread_limit).execute([=] { run_parallel(extent, run, data); });
  }
}

}  // namespace retrograde::runtime
