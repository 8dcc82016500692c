#include "lower/large_stack.h"

#include <pthread.h>

#include <exception>

#include "diagnostics/error.h"

namespace retrograde::ir {
namespace {

constexpr size_t stack_bytes = size_t{1} << 30;
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

}  // namespace

void run_on_large_stack(const std::function<void()>& task) {
  if (is_on_large_stack) return task();
  Job job{task, nullptr};
  pthread_attr_t attributes;
  pthread_attr_init(&attributes);
  pthread_attr_setstacksize(&attributes, stack_bytes);
  pthread_t thread;
  int failed = pthread_create(&thread, &attributes, run_job, &job);
  pthread_attr_destroy(&attributes);
  if (failed) {
    user_error("compile the pipeline", "the compiler needs a thread with a 1 GB stack of address space",
               text("pthread_create gave error ", failed), "Raise the limits on threads and address space (ulimit -u, ulimit -v)");
  }
  pthread_join(thread, nullptr);
  if (job.failure) std::rethrow_exception(job.failure);
}

}  // namespace retrograde::ir
