// A thread pool for parallel loops. The static runtime uses it instead of oneTBB, so that programs need only the
// system's libraries.
//
// A loop is an entry in a list, the newest last. Workers take pieces of the newest loop that has any, so inner loops
// finish first. The thread that started a loop takes pieces of it too, and then waits for workers that are still
// inside. Because the starter always works on its own loop, every loop makes progress whatever the workers do, and
// nesting cannot deadlock. A piece is a fraction of the remaining iterations (guided self-scheduling, Polychronopoulos
// and Kuck 1987): large at first, single iterations at the end.
//
// A waiting starter takes pieces of the loops that were started inside its own. So the loop that it waits for ends
// earlier, and nothing unrelated can delay it (leapfrogging, Wagner and Calder 1993). Its stack holds at most as many
// loops as are nested.
//
// A waiting thread spins for some microseconds before it sleeps (competitive spinning, Karlin, Li, Manasse and Owicki
// 1991): waking a thread costs more than many loops take, and one loop often follows another.
#include "thread_pool.h"

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <cstdlib>
#include <mutex>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "spin.h"
#include "threads.h"

namespace retrograde::runtime {
namespace {

using RunRange = void (*)(void*, int64_t, int64_t);

// Spins until `ready()`, for about as long as it takes to put a thread to sleep and wake it again. Returns false if it
// is still not ready. Yields the core now and then, because others may have work for it.
template <typename Ready>
bool spin_until(const Ready& ready) {
  constexpr int turns = 200, reads = 16;
  for (int turn = 0; turn < turns; turn++) {
    for (int read = 0; read < reads; read++) {
      if (ready()) return true;
      spin_pause();
    }
    std::this_thread::yield();
  }
  return ready();
}

// Spins first, because the pool's mutex is only held for a few instructions.
std::unique_lock<std::mutex> lock_briefly(std::mutex& mutex) {
  if (spin_until([&] { return mutex.try_lock(); })) return {mutex, std::adopt_lock};
  return std::unique_lock(mutex);
}

class SharedLoop {
 public:
  // `around_`: the loop whose piece this thread is running, if any.
  SharedLoop(int64_t extent, int threads, RunRange run, void* data)
      : extent_(extent), threads_(threads), run_(run), data_(data), around_(innermost) {}

  // Runs one piece; returns false if none is left.
  bool run_piece() {
    int64_t begin = next_.load(std::memory_order_relaxed), end = 0;
    do {
      if (begin >= extent_) return false;
      end = begin + std::max<int64_t>(1, (extent_ - begin) / (4 * threads_));
    } while (!next_.compare_exchange_weak(begin, end, std::memory_order_relaxed));
    SharedLoop* const outer = std::exchange(innermost, this);
    run_(data_, begin, end);
    innermost = outer;
    return true;
  }
  bool takes_workers() const { return inside < threads_ - 1 && has_pieces(); }

  // Loops around a listed loop outlive it.
  SharedLoop* around() const { return around_; }
  bool is_inside(const SharedLoop& other) const {
    for (const SharedLoop* loop = around_; loop; loop = loop->around_) {
      if (loop == &other) return true;
    }
    return false;
  }

  std::atomic<int> inside{
      0};  // workers inside; they enter under the pool's mutex while the loop is listed
  bool starter_sleeps = false;  // protected by the pool's mutex

 private:
  static thread_local SharedLoop* innermost;  // the loop whose piece this thread runs

  const int64_t extent_;
  const int threads_;  // that may run it, including its starter
  const RunRange run_;
  void* const data_;
  SharedLoop* const around_;
  std::atomic<int64_t> next_{0};

  bool has_pieces() const { return next_.load(std::memory_order_relaxed) < extent_; }
};

thread_local SharedLoop* SharedLoop::innermost = nullptr;

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

  int threads() { return threads_for(0); }
  int set_threads(int count) {
    const int before = threads_for(0);
    wanted_ = std::min(count, max_threads);
    return before;
  }

  // Ends the workers; the next loop starts new ones. Must not be called inside a loop.
  void shut_down() {
    std::vector<std::thread> workers;
    {
      const std::unique_lock lock = lock_briefly(mutex_);
      stops_ = true;
      workers.swap(workers_);
      changes_++;
    }
    wake_.notify_all();
    for (std::thread& worker : workers) worker.join();
    const std::lock_guard lock(mutex_);
    stops_ = false;
  }

 private:
  std::mutex mutex_;
  std::condition_variable wake_, done_;
  std::vector<SharedLoop*> loops_;  // newest last
  std::vector<std::thread> workers_;
  std::atomic<int> wanted_{0};  // number of threads; 0: not yet known
  bool stops_ = false;
  int sleepers_ = 0;                       // workers that wait for wake_
  std::atomic<int> sleeping_starters_{0};  // starters that wait for done_
  std::atomic<uint64_t> changes_{0};       // counts events that a spinning worker waits for

  int threads_for(int32_t limit) {
    int wanted = wanted_.load(std::memory_order_relaxed);
    if (wanted <= 0) wanted_ = wanted = default_threads();
    return limit > 0 ? std::min(wanted, limit) : wanted;
  }

  void enter(SharedLoop& loop, int helpers) {
    int sleepers = 0;
    bool starter_sleeps = false;
    {
      const std::unique_lock lock = lock_briefly(mutex_);
      loops_.push_back(&loop);
      grow(helpers);
      changes_.fetch_add(1, std::memory_order_release);
      sleepers = sleepers_;
      for (const SharedLoop* outer = loop.around(); outer; outer = outer->around())
        starter_sleeps |= outer->starter_sleeps;
    }
    if (sleepers > 0) helpers == 1 ? wake_.notify_one() : wake_.notify_all();
    if (starter_sleeps) done_.notify_all();
  }

  // If the system cannot create a thread, the pool does without it.
  void grow(int workers) {
    try {
      while (static_cast<int>(workers_.size()) < workers && !stops_)
        workers_.emplace_back([this] { work(); });
    } catch (const std::system_error&) {
    }
  }

  // When this returns the loop may be destroyed: a worker does not touch it after decrementing `inside`.
  void leave(SharedLoop& loop) {
    std::unique_lock lock = lock_briefly(mutex_);
    loops_.erase(std::find(loops_.begin(), loops_.end(), &loop));
    while (loop.inside.load() > 0) {
      if (SharedLoop* inner = newest_with_work(&loop))
        work_on(*inner, lock);
      else
        wait_for_workers(loop, lock);
    }
  }

  // Waits until the workers have left the loop, or another loop has started.
  void wait_for_workers(SharedLoop& loop, std::unique_lock<std::mutex>& lock) {
    const uint64_t seen = changes_.load(std::memory_order_relaxed);
    const auto is_over = [&] {
      return loop.inside.load() == 0 || changes_.load(std::memory_order_acquire) != seen;
    };
    lock.unlock();
    const bool was_short = spin_until(is_over);
    lock = lock_briefly(mutex_);
    if (was_short) return;
    sleeping_starters_++;  // set before checking again; a worker decrements `inside` before it checks this
    loop.starter_sleeps = true;
    done_.wait(lock, is_over);
    loop.starter_sleeps = false;
    sleeping_starters_--;
  }

  void count_out(SharedLoop& loop) {
    if (loop.inside.fetch_sub(1) > 1 || sleeping_starters_.load() == 0) return;
    const std::lock_guard lock(mutex_);  // a starter that saw a worker inside is waiting by now
    done_.notify_all();
  }

  // Finds the newest loop that takes workers and counts this worker in; only among the loops inside `outer`, if given.
  SharedLoop* newest_with_work(const SharedLoop* outer = nullptr) const {
    for (auto it = loops_.rbegin(); it != loops_.rend(); ++it) {
      if (!(*it)->takes_workers() || (outer && !(*it)->is_inside(*outer))) continue;
      (*it)->inside++;
      return *it;
    }
    return nullptr;
  }

  // Releases the mutex while working.
  void work_on(SharedLoop& loop, std::unique_lock<std::mutex>& lock) {
    lock.unlock();
    while (loop.run_piece()) {
    }
    count_out(loop);
    lock = lock_briefly(mutex_);
  }

  void work() {
    std::unique_lock lock = lock_briefly(mutex_);
    while (!stops_) {
      if (SharedLoop* loop = newest_with_work())
        work_on(*loop, lock);
      else
        wait_for_change(lock);
    }
  }

  void wait_for_change(std::unique_lock<std::mutex>& lock) {
    const uint64_t seen = changes_.load(std::memory_order_relaxed);
    const auto is_changed = [&] { return changes_.load(std::memory_order_acquire) != seen; };
    lock.unlock();
    spin_until(is_changed);
    lock = lock_briefly(mutex_);
    if (is_changed()) return;
    sleepers_++;
    wake_.wait(lock, is_changed);
    sleepers_--;
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

int thread_count() { return pool().threads(); }
int set_thread_count(int count) { return pool().set_threads(count); }
void shut_down_threads() { pool().shut_down(); }

}  // namespace retrograde::runtime
