// A stack of parked threads. To start a thread takes longer than most of what a producer inside of
// loops does, so that one that is done waits here for more.
//
// Whoever borrows a thread takes it off the stack, or starts one, and puts it back: a thread on the
// stack is idle for certain, and nobody ever waits for one. More than `max_parked` are not kept.
// The stack is a global without constructor or destructor, whose threads are joined at the end of
// the process or of the library; those still borrowed then are left alone.
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

  SpareThread* next = nullptr;  // below on the stack

 private:
  enum State : int { Idle, Busy, Ended };

  std::atomic<int> state{Idle};
  void (*run)(void*) = nullptr;
  void* data = nullptr;
  std::thread thread;  // the last member: it finds the others made

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

  // A child process has the stack, but not the threads.
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
