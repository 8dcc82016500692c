// The context of a call through HalideRuntime.h.
#pragma once

#include "retrograde_runtime.h"

namespace retrograde::runtime {

struct CallContext {
  explicit CallContext(void* user_context) { retrograde_begin_call(&context, user_context); }
  operator retrograde_context*() { return &context; }
  retrograde_context context;
};

}  // namespace retrograde::runtime
