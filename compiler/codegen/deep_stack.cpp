#include "codegen/deep_stack.h"

#include <pthread.h>

#include <exception>

namespace retrograde::codegen {
namespace {

constexpr size_t stack_bytes = size_t{512} << 20;  // address space; pages come as they are touched

struct Run {
  const std::function<void()>& body;
  std::exception_ptr problem;
};

void* start(void* argument) {
  auto* run = static_cast<Run*>(argument);
  try {
    run->body();
  } catch (...) {
    run->problem = std::current_exception();
  }
  return nullptr;
}

bool start_thread(pthread_t* thread, Run* run) {
  pthread_attr_t attributes;
  if (pthread_attr_init(&attributes) != 0) return false;
  const bool started = pthread_attr_setstacksize(&attributes, stack_bytes) == 0 &&
                       pthread_create(thread, &attributes, start, run) == 0;
  pthread_attr_destroy(&attributes);
  return started;
}

}  // namespace

void run_on_deep_stack(const std::function<void()>& body) {
  Run run{body, nullptr};
  pthread_t thread;
  if (!start_thread(&thread, &run))
    return body();  // no room for it: the stack that we have must do
  pthread_join(thread, nullptr);
  if (run.problem) std::rethrow_exception(run.problem);
}

}  // namespace retrograde::codegen
