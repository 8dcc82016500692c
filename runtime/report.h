// How error messages travel inside the runtime: straight to the handler or, inside a parallel loop, into a Failure, so
// that only the error of the lowest iteration is reported.
#pragma once

#include <cstddef>
#include <cstdint>

#include "retrograde_runtime.h"

namespace retrograde::runtime {

constexpr size_t max_message_bytes = 2048;

// The message of one failed iteration.
struct Failure {
  Failure() { message[0] = 0; }  // the rest stays uninitialised, because every iteration makes one
  char message[max_message_bytes];
  void set(const char* text);
};

// During its lifetime, errors reported on this thread go to `failure`. Scopes nest: a thread that waits in an inner
// loop may run iterations of an outer one.
class FailureScope {
 public:
  explicit FailureScope(Failure* failure);
  ~FailureScope();
  FailureScope(const FailureScope&) = delete;
  FailureScope& operator=(const FailureScope&) = delete;

 private:
  Failure* outer_;
};

// True if the message belongs to an iteration of a parallel loop, which keeps it until the loop ends.
bool keep_for_loop(const char* message);
void report(retrograde_context* context, int32_t code, const char* message);

}  // namespace retrograde::runtime
