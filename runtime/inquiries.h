/* inquiries.h -- what generated code and hosts ask the runtime for, beside what
 * retrograde_runtime.h has it do. */
#ifndef RETROGRADE_INQUIRIES_H
#define RETROGRADE_INQUIRIES_H

#ifdef __cplusplus
extern "C" {
#endif

struct retrograde_context;
struct halide_profiler_state; /* of HalideRuntime.h */

/* user_data of the context, what the caller handed over: an argument for C functions that the
 * pipeline calls. Null for a null context. */
void* retrograde_user_context(struct retrograde_context*);

/* All profiled pipelines as a list. Its `lock` guards nothing: it is read while no profiled pipeline
 * runs. Changes of sleep_time, the milliseconds between two looks, are heeded. Never null. */
struct halide_profiler_state* retrograde_profiler_state(void);

#ifdef __cplusplus
}
#endif

#endif
