// Adapts generated code to HalideRuntime.h: makes a call's context, whose handlers call the halide_ functions with the
// caller's user context.
#include <cstdint>
#include <cstring>

#include "halide/cuda_context.h"
#include "halide/handlers.h"
#include "halide/weak.h"
#include "retrograde_runtime.h"

namespace {

// A program's own halide_malloc may align less than generated code needs. So blocks are aligned here, and the pointer
// to free is stored in front of them.
void* allocate(retrograde_context* context, size_t bytes) {
  constexpr size_t alignment = retrograde_allocation_alignment;
  if (bytes > SIZE_MAX - 2 * alignment) return nullptr;
  void* given = halide_malloc(context->user_data, bytes + alignment + sizeof(void*));
  if (!given) return nullptr;
  const auto first = reinterpret_cast<uintptr_t>(given) + sizeof(void*);
  char* block = static_cast<char*>(given) + ((first + alignment - 1) / alignment * alignment -
                                             reinterpret_cast<uintptr_t>(given));
  std::memcpy(block - sizeof given, &given, sizeof given);
  return block;
}

void release(retrograde_context* context, void* block) {
  void* given;
  std::memcpy(&given, static_cast<char*>(block) - sizeof given, sizeof given);
  halide_free(context->user_data, given);
}

int32_t trace(retrograde_context* context, const halide_trace_event_t* event) {
  return halide_trace(context->user_data, event);
}

struct Tasks {
  retrograde_context* context;
  retrograde_task task;
  uint8_t* closure;
};

int run_task(void*, int index, uint8_t* data) {
  const auto* tasks = reinterpret_cast<const Tasks*>(data);
  return tasks->task(tasks->context, index, tasks->closure);
}

int32_t run_parallel(retrograde_context* context, retrograde_task task, int32_t min, int32_t extent,
                     uint8_t* closure) {
  if (extent <= 0) return 0;
  Tasks tasks{context, task, closure};
  return halide_do_par_for(context->user_data, run_task, min, extent,
                           reinterpret_cast<uint8_t*>(&tasks));
}

}  // namespace

void retrograde_begin_call(retrograde_context* context, void* user_context) {
  *context = retrograde::runtime::reporting_context(user_context);
  context->malloc_handler = allocate;
  context->free_handler = release;
  context->parallel_handler = run_parallel;
  context->trace_handler = trace;
  context->gpu_handlers = retrograde::runtime::halide_gpu_handlers();
}
