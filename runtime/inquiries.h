/* inquiries.h -- queries that generated code and hosts make of the runtime, in addition to retrograde_runtime.h. */
#ifndef RETROGRADE_INQUIRIES_H
#define RETROGRADE_INQUIRIES_H

#ifdef __cplusplus
extern "C" {
#endif

struct retrograde_context;
struct halide_profiler_state; /* of HalideRuntime.h */

/* user_data of the context, which the caller supplied: an argument for C functions that the pipeline calls. Null for
 * a null context. */
void* retrograde_user_context(struct retrograde_context*);

/* All profiled pipelines as a list. Its `lock` is unused: read the list only while no profiled pipeline runs.
 * Changes of sleep_time, the milliseconds between two samples, take effect. Never null. */
struct halide_profiler_state* retrograde_profiler_state(void);

#ifdef __cplusplus
}
#endif

#endif
