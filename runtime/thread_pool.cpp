// The threads under the parallel loops where there is no oneTBB: a pool of our own, which the
// static runtime uses so that programs need no library but the system's.
//
// A loop is an entry in a list, the newest last. Workers take pieces of the newest loop that has
// any, so that inner loops finish first; whoever started a loop takes pieces of it too and then
// waits for the workers that are still inside. Because the starter always works on its own loop,
// every loop makes progress whatever the workers do, and nesting cannot deadlock. Pieces are a
// share of what is left (guided self-scheduling, Polychronopoulos and Kuck 1987): large at first,
// single iterations at the end.
#include "thread_pool.h"

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <cstdlib>
#include <mutex>
#include <system_error>
#include <thread>
#include <vector>

#include "threads.h"

namespace retrograde::runtime {
namespace {

using RunRange = void (*)(void*, int64_t, int64_t);

class SharedLoop {
 public:
  SharedLoop(int64_t extent, int threads, RunRange run, void* data)
      : extent_(extent), threads_(threads), run_(run), data_(data) {}

  // Runs one piece; false when none is left.
  bool run_piece() {
    int64_t begin = next_.load(std::memory_order_relaxed), end = 0;
    do {
      if (begin >= extent_) return false;
      end = begin + std::max<int64_t>(1, (extent_ - begin) / (4 * threads_));
    } while (!next_.compare_exchange_weak(begin, end, std::memory_order_relaxed));
    run_(data_, begin, end);
    return true;
  }
  bool has_pieces() const { return next_.load(std::memory_order_relaxed) < extent_; }
  bool takes_workers() const { return inside < threads_ - 1 && has_pieces(); }

  int inside = 0;  // workers, guarded by the pool's mutex

 private:
  const int64_t extent_;
  const int threads_;  // that may run it, its starter included
  const RunRange run_;
  void* const data_;
  std::atomic<int64_t> next_{0};
};

int default_threads() {
  for (const char* name : {"HL_NUM_THREADS", "HL_NUMTHREADS"}) {
    const char* text = std::getenv(name);
    const int count = text ? std::atoi(text) : 0;
    if (count > 0) return std::min(count, max_threads);
  }
  return std::clamp(static_cast<int>(std::thread::hardware_concurrency()), 1, max_threads);
}

class Pool {
 public:
  void run(int64_t extent, int32_t limit, RunRange run, void* data) {
    const int threads = threads_for(limit);
    if (threads == 1 || extent == 1) return run(data, 0, extent);
    SharedLoop loop(extent, threads, run, data);
    enter(loop, static_cast<int>(std::min<int64_t>(threads, extent)) - 1);
    while (loop.run_piece()) {
    }
    leave(loop);
  }

  int set_threads(int count) {
    const std::lock_guard lock(mutex_);
    const int before = wanted_ > 0 ? wanted_ : default_threads();
    wanted_ = std::min(count, max_threads);
    return before;
  }

  // Ends the workers; the next loop starts new ones. Not from inside a loop.
  void shut_down() {
    std::vector<std::thread> workers;
    {
      const std::lock_guard lock(mutex_);
      stops_ = true;
      workers.swap(workers_);
    }
    wake_.notify_all();
    for (std::thread& worker : workers) worker.join();
    const std::lock_guard lock(mutex_);
    stops_ = false;
  }

 private:
  std::mutex mutex_;
  std::condition_variable wake_, done_;
  std::vector<SharedLoop*> loops_;  // the newest last
  std::vector<std::thread> workers_;
  int wanted_ = 0;  // 0: default_threads
  bool stops_ = false;

  int threads_for(int32_t limit) {
    const std::lock_guard lock(mutex_);
    if (wanted_ <= 0) wanted_ = default_threads();
    return limit > 0 ? std::min(wanted_, limit) : wanted_;
  }

  void enter(SharedLoop& loop, int helpers) {
    {
      const std::lock_guard lock(mutex_);
      loops_.push_back(&loop);
      grow(helpers);
    }
    helpers == 1 ? wake_.notify_one() : wake_.notify_all();
  }

  // A thread that cannot be had is done without.
  void grow(int workers) {
    try {
      while (static_cast<int>(workers_.size()) < workers && !stops_)
        workers_.emplace_back([this] { work(); });
    } catch (const std::system_error&) {
    }
  }

  void leave(SharedLoop& loop) {
    std::unique_lock lock(mutex_);
    loops_.erase(std::find(loops_.begin(), loops_.end(), &loop));
    done_.wait(lock, [&] { return loop.inside == 0; });
  }

  SharedLoop* newest_with_work() const {
    for (auto it = loops_.rbegin(); it != loops_.rend(); ++it) {
      if ((*it)->takes_workers()) return *it;
    }
    return nullptr;
  }

  void work() {
    std::unique_lock lock(mutex_);
    while (!stops_) {
      SharedLoop* loop = newest_with_work();
      if (!loop) {
        wake_.wait(lock);
        continue;
      }
      loop->inside++;
      lock.unlock();
      while (loop->run_piece()) {
      }
      lock.lock();
      if (--loop->inside == 0) done_.notify_all();
    }
  }
};

Pool& pool() {
  static Pool& instance = *new Pool;  // never destroyed: loops may run while the process exits
  return instance;
}

}  // namespace

void run_on_threads(int64_t extent, int32_t thread_limit, RunRange run, void* data) {
  pool().run(extent, thread_limit, run, data);
}

int set_thread_count(int count) { return pool().set_threads(count); }
void shut_down_threads() { pool().shut_down(); }

}  // namespace retrograde::runtime
