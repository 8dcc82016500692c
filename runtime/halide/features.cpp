// Tracing and profiling functions of HalideRuntime.h.
#include <cstdint>

#include "halide/handlers.h"
#include "halide/weak.h"
#include "inquiries.h"
#include "retrograde_runtime.h"
#include "trace.h"

namespace {

halide_trace_t custom_trace = nullptr;

}  // namespace

RETROGRADE_WEAK int32_t halide_default_trace(void* user_context,
                                             const halide_trace_event_t* event) {
  retrograde_context context = retrograde::runtime::reporting_context(user_context);
  return retrograde::runtime::trace_to(halide_get_trace_file(user_context), &context, event);
}

RETROGRADE_WEAK int32_t halide_trace(void* user_context, const halide_trace_event_t* event) {
  const halide_trace_t handler = __atomic_load_n(&custom_trace, __ATOMIC_ACQUIRE);
  return handler ? handler(user_context, event) : halide_default_trace(user_context, event);
}

RETROGRADE_WEAK halide_trace_t halide_set_custom_trace(halide_trace_t trace) {
  const halide_trace_t before = __atomic_exchange_n(&custom_trace, trace, __ATOMIC_ACQ_REL);
  return before ? before : halide_default_trace;
}

// 0 selects text output, whatever HL_TRACE_FILE says.
RETROGRADE_WEAK void halide_set_trace_file(int file) { retrograde::runtime::set_trace_file(file); }
RETROGRADE_WEAK int halide_get_trace_file(void*) { return retrograde::runtime::trace_file(); }
// Every packet is written when it happens. Events that come later are printed.
RETROGRADE_WEAK int halide_shutdown_trace() {
  return retrograde::runtime::set_trace_file(0) ? 0 : halide_error_code_generic_error;
}

RETROGRADE_WEAK halide_profiler_pipeline_stats* halide_profiler_get_pipeline_state(
    const char* pipeline_name) {
  return retrograde_profiler_pipeline(pipeline_name);
}
RETROGRADE_WEAK halide_profiler_state* halide_profiler_get_state() {
  return retrograde_profiler_state();
}
// Samples are taken by the profiler's own thread: there is no timer to start or to stop.
RETROGRADE_WEAK int halide_profiler_sample(halide_profiler_state* state, uint64_t*) {
  return state ? state->sleep_time : -1;
}
RETROGRADE_WEAK void halide_start_timer_chain() {}
RETROGRADE_WEAK void halide_disable_timer_interrupt() {}
RETROGRADE_WEAK void halide_enable_timer_interrupt() {}
RETROGRADE_WEAK void halide_profiler_report(void* user_context) {
  retrograde_context context = retrograde::runtime::reporting_context(user_context);
  retrograde_profiler_report(&context);
}
RETROGRADE_WEAK void halide_profiler_reset() { retrograde_profiler_reset(); }
RETROGRADE_WEAK void halide_profiler_shutdown() { retrograde_profiler_reset(); }
