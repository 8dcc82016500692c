// A device call for error reporting: its action (the first of a message's four parts), its caller, and the code that it
// returns on failure.
#pragma once

#include <new>

#include "retrograde_runtime.h"

namespace retrograde::runtime {

struct Driver;

// A line of text, formatted by retrograde_format_message.
class Line {
 public:
  template <typename... Args>
  explicit Line(const char* format, Args... args) {
    retrograde_format_message(text_, sizeof text_, format, args...);
  }
  operator const char*() const { return text_; }

 private:
  char text_[512];
};

class Request {
 public:
  // `asked`: the action, which completes "cannot ...".
  template <typename... Args>
  Request(retrograde_context* caller, int32_t code, const char* asked, Args... args)
      : caller(caller), code(code), asked_(asked, args...) {}

  // Reports the error and returns its code.
  int32_t refuse(const char* rule, const char* evidence, const char* advice) const {
    return refuse(code, rule, evidence, advice);
  }
  int32_t refuse(int32_t other_code, const char* rule, const char* evidence,
                 const char* advice) const;
  int32_t refuse_null_buffer() const;
  // Reports that a driver function returned `result`; `evidence` may be empty.
  int32_t driver_failed(const Driver&, const char* function, int result,
                        const char* evidence = "") const;

  retrograde_context* const caller;
  const int32_t code;

 private:
  const Line asked_;
};

// Returns the result of `work`, or the error code for out of memory if `work` throws std::bad_alloc.
template <typename Work>
int32_t guarded(const Request& request, Work work) {
  try {
    return work();
  } catch (const std::bad_alloc&) {
    return request.refuse(retrograde_error_out_of_memory, "there must be memory for bookkeeping",
                          "the host has none left", "Free some");
  }
}

}  // namespace retrograde::runtime
