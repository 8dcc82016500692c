// How an error message travels inside the runtime: straight to the handler, or, inside a parallel
// loop, into a Failure, so that only the error of the lowest iteration is told.
#pragma once

#include <cstddef>
#include <cstdint>

#include "retrograde_runtime.h"

namespace retrograde::runtime {

constexpr size_t max_message_bytes = 2048;

// The message of one failed iteration.
struct Failure {
  Failure() { message[0] = 0; }  // the rest stays unset: one is made for every iteration
  char message[max_message_bytes];
  void set(const char* text);
};

// While it lives, errors reported on this thread go to `failure`. Scopes nest: a thread that waits
// in an inner loop may run iterations of an outer one.
class FailureScope {
 public:
  explicit FailureScope(Failure* failure);
  ~FailureScope();
  FailureScope(const FailureScope&) = delete;
  FailureScope& operator=(const FailureScope&) = delete;

 private:
  Failure* outer_;
};

// True when the message belongs to an iteration of a parallel loop, which keeps it until its end.
bool keep_for_loop(const char* message);
void report(retrograde_context* context, int32_t code, const char* message);

}  // namespace retrograde::runtime
