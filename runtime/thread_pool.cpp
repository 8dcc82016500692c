// The threads under the parallel loops where there is no oneTBB: a pool of our own, which the
// static runtime uses so that programs need no library but the system's.
//
// A loop is an entry in a list, the newest last. Workers take pieces of the newest loop that has
// any, so that inner loops finish first; whoever started a loop takes pieces of it too and then
// waits for the workers that are still inside. Because the starter always works on its own loop,
// every loop makes progress whatever the workers do, and nesting cannot deadlock. Pieces are a
// share of what is left (guided self-scheduling, Polychronopoulos and Kuck 1987): large at first,
// single iterations at the end.
//
// A starter that waits takes pieces of the loops that were started inside of its own: what it waits for
// ends earlier, and nothing else can delay it (leapfrogging, Wagner and Calder 1993). Its stack holds
// no more loops at once than are nested.
//
// Who waits spins for some microseconds before it sleeps (competitive spinning, Karlin, Li, Manasse
// and Owicki 1991): to wake a thread costs more than many a loop takes, and loops follow one
// another.
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

// Spins until `ready()`, for about as long as it takes to put a thread to sleep and to wake it
// again. False when it still is not. Gives the core away now and then: others may have work for it.
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

// The pool's mutex is held for some instructions only.
std::unique_lock<std::mutex> lock_briefly(std::mutex& mutex) {
  if (spin_until([&] { return mutex.try_lock(); })) return {mutex, std::adopt_lock};
  return std::unique_lock(mutex);
}

class SharedLoop {
 public:
  // Started by the piece that this thread runs, if any.
  SharedLoop(int64_t extent, int threads, RunRange run, void* data)
      : extent_(extent), threads_(threads), run_(run), data_(data), around_(innermost) {}

  // Runs one piece; false when none is left.
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

  // The loops around one that is listed outlive it.
  SharedLoop* around() const { return around_; }
  bool is_inside(const SharedLoop& other) const {
    for (const SharedLoop* loop = around_; loop; loop = loop->around_) {
      if (loop == &other) return true;
    }
    return false;
  }

  std::atomic<int> inside{0};   // workers; they enter under the pool's mutex, while it is listed
  bool starter_sleeps = false;  // under the pool's mutex

 private:
  static thread_local SharedLoop* innermost;  // of which this thread runs a piece

  const int64_t extent_;
  const int threads_;  // that may run it, its starter included
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

  // Ends the workers; the next loop starts new ones. Not from inside a loop.
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
  std::vector<SharedLoop*> loops_;  // the newest last
  std::vector<std::thread> workers_;
  std::atomic<int> wanted_{0};  // threads; 0: not yet known
  bool stops_ = false;
  int sleepers_ = 0;                       // workers that only wake_ wakes
  std::atomic<int> sleeping_starters_{0};  // that only done_ wakes
  std::atomic<uint64_t> changes_{0};       // counts what a worker that spins would like to know

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

  // A thread that cannot be had is done without.
  void grow(int workers) {
    try {
      while (static_cast<int>(workers_.size()) < workers && !stops_)
        workers_.emplace_back([this] { work(); });
    } catch (const std::system_error&) {
    }
  }

  // The loop is gone when this returns: no worker touches it after it has counted itself out.
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

  // Until they have left the loop, or another one is there.
  void wait_for_workers(SharedLoop& loop, std::unique_lock<std::mutex>& lock) {
    const uint64_t seen = changes_.load(std::memory_order_relaxed);
    const auto is_over = [&] {
      return loop.inside.load() == 0 || changes_.load(std::memory_order_acquire) != seen;
    };
    lock.unlock();
    const bool was_short = spin_until(is_over);
    lock = lock_briefly(mutex_);
    if (was_short) return;
    sleeping_starters_++;  // before it looks again, as a worker counts itself out before it looks
                           // here
    loop.starter_sleeps = true;
    done_.wait(lock, is_over);
    loop.starter_sleeps = false;
    sleeping_starters_--;
  }

  void count_out(SharedLoop& loop) {
    if (loop.inside.fetch_sub(1) > 1 || sleeping_starters_.load() == 0) return;
    const std::lock_guard lock(mutex_);  // whoever saw a worker inside waits by now
    done_.notify_all();
  }

  // A loop that takes a worker, and has counted this one in; of those inside of `outer`, if given.
  SharedLoop* newest_with_work(const SharedLoop* outer = nullptr) const {
    for (auto it = loops_.rbegin(); it != loops_.rend(); ++it) {
      if (!(*it)->takes_workers() || (outer && !(*it)->is_inside(*outer))) continue;
      (*it)->inside++;
      return *it;
    }
    return nullptr;
  }

  // The mutex is free meanwhile.
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
