// A POSIX thread, because std::thread has no stack size. The memory is only reserved: pages that
// the recursion never reaches cost nothing.
#include "testing/deep_stack.h"

#include <pthread.h>

#include <exception>

#include "diagnostics/error.h"

namespace retrograde::oracle {

namespace {

constexpr size_t stack_bytes = size_t{1} << 30;

struct Job {
  const std::function<void()>* f;
  std::exception_ptr error;
};

void* run(void* argument) {
  Job& job = *static_cast<Job*>(argument);
  try {
    (*job.f)();
  } catch (...) {
    job.error = std::current_exception();
  }
  return nullptr;
}

}  // namespace

void on_deep_stack(const std::function<void()>& f) {
  Job job{&f, nullptr};
  pthread_attr_t attributes;
  pthread_attr_init(&attributes);
  pthread_attr_setstacksize(&attributes, stack_bytes);
  pthread_t thread;
  const int failure = pthread_create(&thread, &attributes, run, &job);
  pthread_attr_destroy(&attributes);
  if (failure) internal_error(text("no thread with ", stack_bytes, " bytes of stack"));
  pthread_join(thread, nullptr);
  if (job.error) std::rethrow_exception(job.error);
}

}  // namespace retrograde::oracle
