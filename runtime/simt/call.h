// The prologue of every function of the simulated driver: takes the lock, counts the call, and makes it fail if a test
// asked for that.
#pragma once

#include <new>

#include "simt/state.h"

namespace retrograde::simt {

// Counts a call. Returns success, or the error that the call must return without doing anything.
Result begin_call(const char* function);
int64_t call_count(const char* function);
const char* function_name(int32_t index);
void add_failure(const char* function, int64_t nth, Result);
int32_t cancel_failures();

template <typename Work>
Result call(const char* function, Work work) {
  const std::lock_guard lock(driver_mutex());
  const Result verdict = begin_call(function);
  if (verdict != success) return verdict;
  if (!state().is_initialized) return not_initialized;
  try {
    return work();
  } catch (const std::bad_alloc&) {
    return out_of_memory;
  }
}

// Runs `work` with the thread's current context, which must exist and not be lost.
template <typename Work>
Result call_in_context(const char* function, Work work) {
  return call(function, [&]() -> Result {
    ContextState* context = find_in(state().contexts, current_context());
    if (!context) return invalid_context;
    if (context->lost != success) return context->lost;
    return work(*context);
  });
}

// Runs `work` on a stream of the current context.
template <typename Work>
Result call_on_stream(const char* function, Stream handle, Work work) {
  return call_in_context(function, [&](ContextState& context) -> Result {
    StreamState* stream = find_stream(context, handle);
    return stream ? work(*stream) : Result{invalid_handle};
  });
}

}  // namespace retrograde::simt

#define RETROGRADE_SIMT_EXPORT extern "C" __attribute__((visibility("default")))
