// A stack of parked threads. Starting a thread takes longer than most producers inside loops run, so finished threads
// wait here for more work.
//
// A borrower pops a thread from the stack, or starts one, and pushes it back afterwards. So every thread on the stack
// is idle, and nobody ever waits for one. At most `max_parked` are kept. The stack is a global without constructor or
// destructor. Its threads are joined when the process exits or the library is unloaded; threads that are still borrowed
// then are left running.
#include "spare_threads.h"

#include <pthread.h>

#include <atomic>
#include <mutex>
#include <thread>

namespace retrograde::runtime {

struct SpareThread {
  SpareThread() : thread([this] { work(); }) {}

  void begin(void (*function)(void*), void* argument) {
    run = function;
    data = argument;
    set(Busy);
  }
  void wait_for_its_work() const { state.wait(Busy, std::memory_order_acquire); }
  void end() {
    set(Ended);
    thread.join();
  }

  SpareThread* next = nullptr;  // the next one on the stack

 private:
  enum State : int { Idle, Busy, Ended };

  std::atomic<int> state{Idle};
  void (*run)(void*) = nullptr;
  void* data = nullptr;
  std::thread thread;  // last member: the thread starts after the others are initialised

  void set(State now) {
    state.store(now, std::memory_order_release);
    state.notify_all();
  }
  void work() {
    for (;;) {
      state.wait(Idle, std::memory_order_acquire);
      if (state.load(std::memory_order_acquire) == Ended) return;
      run(data);
      set(Idle);
    }
  }
};

namespace {

constexpr int max_parked = 16;

class Stack {
 public:
  SpareThread* take() {
    const std::lock_guard lock(mutex_);
    SpareThread* top = top_;
    if (top) {
      top_ = top->next;
      count_--;
    }
    return top;
  }
  bool put(SpareThread* thread) {
    const std::lock_guard lock(mutex_);
    if (count_ == max_parked) return false;
    thread->next = top_;
    top_ = thread;
    count_++;
    return true;
  }

  // After fork(), a child process has the stack but not the threads.
  void before_process_fork() { mutex_.lock(); }
  void after_process_fork() { mutex_.unlock(); }
  void in_child_process() {
    top_ = nullptr;
    count_ = 0;
    mutex_.unlock();
  }

 private:
  std::mutex mutex_;
  SpareThread* top_ = nullptr;
  int count_ = 0;
};

constinit Stack parked;

__attribute__((constructor)) void watch_process_forks() {
  pthread_atfork([] { parked.before_process_fork(); }, [] { parked.after_process_fork(); },
                 [] { parked.in_child_process(); });
}

__attribute__((destructor)) void end_at_unload() { end_spare_threads(); }

}  // namespace

SpareThread* begin_on_spare_thread(void (*run)(void*), void* data) {
  SpareThread* thread = parked.take();
  try {
    if (!thread) thread = new SpareThread;
  } catch (...) {
    return nullptr;
  }
  thread->begin(run, data);
  return thread;
}

void finish_on(SpareThread* thread) {
  thread->wait_for_its_work();
  if (parked.put(thread)) return;
  thread->end();
  delete thread;
}

void end_spare_threads() {
  while (SpareThread* thread = parked.take()) {
    thread->end();
    delete thread;
  }
}

}  // namespace retrograde::runtime
