#include "diagnostics/large_stack.h"

// POSIX threads, because std::thread cannot set the stack size.
#include <pthread.h>

#include <exception>

namespace retrograde {
namespace {

thread_local bool is_on_large_stack = false;

struct Job {
  const std::function<void()>& task;
  std::exception_ptr failure;
};

void* run_job(void* argument) {
  Job& job = *static_cast<Job*>(argument);
  is_on_large_stack = true;
  try {
    job.task();
  } catch (...) {
    job.failure = std::current_exception();
  }
  return nullptr;
}

bool start_thread(pthread_t* thread, size_t stack_bytes, Job* job) {
  pthread_attr_t attributes;
  if (pthread_attr_init(&attributes) != 0) return false;
  const bool started = pthread_attr_setstacksize(&attributes, stack_bytes) == 0 &&
                       pthread_create(thread, &attributes, run_job, job) == 0;
  pthread_attr_destroy(&attributes);
  return started;
}

}  // namespace

void run_on_large_stack(const std::function<void()>& task) {
  if (is_on_large_stack) return task();
  Job job{task, nullptr};
  pthread_t thread;
  for (size_t stack_bytes = size_t{1} << 30; stack_bytes >= size_t{16} << 20; stack_bytes /= 4) {
    if (!start_thread(&thread, stack_bytes, &job)) continue;
    pthread_join(thread, nullptr);
    if (job.failure) std::rethrow_exception(job.failure);
    return;
  }
  task();
}

}  // namespace retrograde
