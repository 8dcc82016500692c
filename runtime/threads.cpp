// oneTBB behind one function. This file is compiled without the race detector: TBB's library is not
// built for it, so its templates would be reported; parallel.cpp shows the detector the order that
// TBB guarantees.
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
  // Grain 1 and TBB's auto partitioner: iterations are rows or tiles, each worth far more than a
  // task; ranges split further only where a thread runs dry.
  tbb::parallel_for(
      tbb::blocked_range<int64_t>(0, extent),
      [=](const tbb::blocked_range<int64_t>& range) { run(data, range.begin(), range.end()); });
}

// An arena is too dear to make for each loop, so there is one for each limit ever asked for.
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
