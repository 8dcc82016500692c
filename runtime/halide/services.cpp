// Traces, the profiler and the cache of memoized results by HalideRuntime.h.
#include <atomic>

#include "halide/weak.h"
#include "retrograde_runtime.h"

namespace {
std::atomic<halide_trace_t> trace_handler{halide_default_trace};
}

// As text through halide_print, or as packets to the file that HL_TRACE_FILE names.
RETROGRADE_WEAK int32_t halide_default_trace(void* user_context,
                                             const halide_trace_event_t* event) {
  retrograde_context context;
  retrograde_begin_call(&context, user_context);
  return retrograde_default_trace(&context, event);
}
RETROGRADE_WEAK int32_t halide_trace(void* user_context, const halide_trace_event_t* event) {
  return trace_handler.load()(user_context, event);
}
RETROGRADE_WEAK halide_trace_t halide_set_custom_trace(halide_trace_t handler) {
  return trace_handler.exchange(handler ? handler : halide_default_trace);
}

RETROGRADE_WEAK void halide_memoization_cache_set_size(int64_t bytes) {
  retrograde_memoization_set_size(bytes);
}
RETROGRADE_WEAK void halide_memoization_cache_evict(void*, uint64_t eviction_key) {
  retrograde_memoization_evict(eviction_key);
}
RETROGRADE_WEAK void halide_memoization_cache_cleanup() { retrograde_memoization_cleanup(); }

RETROGRADE_WEAK void halide_profiler_report(void* user_context) {
  retrograde_context context;
  retrograde_begin_call(&context, user_context);
  retrograde_profiler_report(&context);
}
RETROGRADE_WEAK void halide_profiler_reset() { retrograde_profiler_reset(); }
RETROGRADE_WEAK halide_profiler_pipeline_stats* halide_profiler_get_pipeline_state(
    const char* pipeline_name) {
  return retrograde_profiler_pipeline(pipeline_name);
}
