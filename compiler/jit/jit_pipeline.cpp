#include "jit/jit_pipeline.h"

#include <HalideRuntime.h>

#include "retrograde_runtime.h"

namespace retrograde::jit {
namespace {

// The state of a call. The runtime's handlers get the context, which is its first member, and find the rest from it.
struct HandledCall {
  retrograde_context context = {};
  CallContext* caller = nullptr;
};

HandledCall& handled_call(retrograde_context* context) {
  return *reinterpret_cast<HandledCall*>(context);
}
CallContext& caller_of(retrograde_context* context) { return *handled_call(context).caller; }

// Keeps a call's first error: it causes the others.
void keep_first_error(retrograde_context* context, int, const char* message) {
  if (std::string& error = caller_of(context).error; error.empty()) error = message;
}

void hand_on_print(retrograde_context* context, const char* message) {
  if (const auto& print = caller_of(context).print) print(message);
}

void* hand_on_malloc(retrograde_context* context, size_t bytes) {
  CallContext& caller = caller_of(context);
  return caller.handlers.custom_malloc(caller.user_context, bytes);
}

void hand_on_free(retrograde_context* context, void* block) {
  CallContext& caller = caller_of(context);
  caller.handlers.custom_free(caller.user_context, block);
}

int32_t hand_on_trace(retrograde_context* context, const halide_trace_event_t* event) {
  CallContext& caller = caller_of(context);
  return caller.handlers.custom_trace(caller.user_context, event);
}

// Adapts a task of the runtime to the form that user handlers take.
struct WrappedTask {
  retrograde_context* context;
  retrograde_task task;
  uint8_t* closure;
  static int run(JITUserContext*, int index, uint8_t* closure) {
    const auto& self = *reinterpret_cast<WrappedTask*>(closure);
    return self.task(self.context, index, self.closure);
  }
};

int32_t hand_on_task(retrograde_context* context, retrograde_task task, int32_t index,
                     uint8_t* closure) {
  CallContext& caller = caller_of(context);
  WrappedTask wrapped{context, task, closure};
  return caller.handlers.custom_do_task(caller.user_context, WrappedTask::run, index,
                                        reinterpret_cast<uint8_t*>(&wrapped));
}

int32_t hand_on_loop(retrograde_context* context, retrograde_task task, int32_t min, int32_t extent,
                     uint8_t* closure) {
  CallContext& caller = caller_of(context);
  WrappedTask wrapped{context, task, closure};
  return caller.handlers.custom_do_par_for(caller.user_context, WrappedTask::run, min, extent,
                                           reinterpret_cast<uint8_t*>(&wrapped));
}

int32_t hand_on_acquire(retrograde_context* context, void** cuda_context, int32_t create) {
  CallContext& caller = caller_of(context);
  return caller.handlers.custom_cuda_acquire_context(caller.user_context, cuda_context,
                                                     create != 0);
}

int32_t hand_on_release(retrograde_context* context) {
  CallContext& caller = caller_of(context);
  return caller.handlers.custom_cuda_release_context(caller.user_context);
}

int32_t hand_on_get_stream(retrograde_context* context, void* cuda_context, void** stream) {
  CallContext& caller = caller_of(context);
  return caller.handlers.custom_cuda_get_stream(caller.user_context, cuda_context, stream);
}

retrograde_gpu_handlers gpu_handlers_for(const JITHandlers& handlers) {
  retrograde_gpu_handlers given = {};
  if (handlers.custom_cuda_acquire_context) given.acquire_context = hand_on_acquire;
  if (handlers.custom_cuda_release_context) given.release_context = hand_on_release;
  if (handlers.custom_cuda_get_stream) given.get_stream = hand_on_get_stream;
  return given;
}

retrograde_context context_for(const CallContext& caller) {
  const JITHandlers& handlers = caller.handlers;
  retrograde_context context = {};
  context.error_handler = keep_first_error;
  context.print_handler = hand_on_print;
  context.thread_limit = caller.thread_limit;
  context.user_data = caller.user_context;
  if (handlers.custom_malloc) context.malloc_handler = hand_on_malloc;
  if (handlers.custom_free) context.free_handler = hand_on_free;
  if (handlers.custom_trace) context.trace_handler = hand_on_trace;
  if (handlers.custom_do_task) context.task_handler = hand_on_task;
  if (handlers.custom_do_par_for) context.parallel_handler = hand_on_loop;
  return context;
}

class JitPipeline : public CompiledPipeline {
 public:
  JitPipeline(ExternPipeline compiled, const Target& target)
      : compiled_(std::move(compiled)),
        is_profiled_(target.has_feature(Target::Profile)),
        writes_on_host_(!target.has_gpu_feature()) {}

  const std::vector<ir::LoweredArgument>& arguments() const override { return compiled_.arguments; }

  int run(void* const* argv, CallContext& caller) const override {
    HandledCall state{context_for(caller), &caller};
    const retrograde_gpu_handlers gpu_handlers = gpu_handlers_for(caller.handlers);
    state.context.gpu_handlers = &gpu_handlers;
    const int code = compiled_.code->call(&state.context, const_cast<void**>(argv));
    if (code == 0 && writes_on_host_) mark_written(argv);
    if (is_profiled_) {
      retrograde_profiler_report(&state.context);
      retrograde_profiler_reset();
    }
    return code;
  }

 private:
  // Marks the host copies of outputs as dirty, so that a later use on a device copies them.
  void mark_written(void* const* argv) const {
    for (size_t i = 0; i < arguments().size(); i++) {
      if (arguments()[i].kind != ir::LoweredArgument::Kind::OutputBuffer) continue;
      auto* buffer = static_cast<halide_buffer_t*>(argv[i]);
      if (buffer->host) buffer->set_host_dirty();
    }
  }

  const ExternPipeline compiled_;
  const bool is_profiled_;  // if set, every call reports its profile
  const bool writes_on_host_;
};

}  // namespace

std::shared_ptr<CompiledPipeline> make_pipeline(ExternPipeline compiled, const Target& target) {
  return std::make_shared<JitPipeline>(std::move(compiled), target);
}

}  // namespace retrograde::jit
