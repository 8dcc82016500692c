// default_compiler.cpp -- implements the front end's realize(): lowers the pipeline and compiles it in this process.
#include <HalideRuntime.h>

#include "autoschedule/choose_schedule.h"
#include "frontend/run/compiler_interface.h"
#include "frontend/run/warnings.h"
#include "jit/extern_pipelines.h"
#include "jit/jit.h"
#include "lower/lower.h"
#include "retrograde_runtime.h"

namespace retrograde {
namespace {

// The state of a call. The runtime's handlers get the context, which is its first member, and find the rest from it.
struct CallState {
  retrograde_context context = {};
  CallContext* caller = nullptr;
};

CallState& state_of(retrograde_context* context) { return *reinterpret_cast<CallState*>(context); }
CallContext& caller_of(retrograde_context* context) { return *state_of(context).caller; }

// Keeps a call's first error: it causes the others.
void keep_error(retrograde_context* context, int, const char* message) {
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
  context.error_handler = keep_error;
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
  JitPipeline(std::vector<ir::LoweredArgument> arguments,
              std::shared_ptr<const jit::CompiledFunction> code, jit::ExternPipelines called,
              const Target& target)
      : arguments_(std::move(arguments)),
        called_(std::move(called)),
        code_(std::move(code)),
        is_profiled_(target.has_feature(Target::Profile)),
        writes_on_host_(!target.has_gpu_feature()) {}

  const std::vector<ir::LoweredArgument>& arguments() const override { return arguments_; }

  int run(void* const* argv, CallContext& caller) const override {
    CallState state{context_for(caller), &caller};
    const retrograde_gpu_handlers gpu_handlers = gpu_handlers_for(caller.handlers);
    state.context.gpu_handlers = &gpu_handlers;
    const int code = code_->call(&state.context, const_cast<void**>(argv));
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
    for (size_t i = 0; i < arguments_.size(); i++) {
      if (arguments_[i].kind != ir::LoweredArgument::Kind::OutputBuffer) continue;
      auto* buffer = static_cast<halide_buffer_t*>(argv[i]);
      if (buffer->host) buffer->set_host_dirty();
    }
  }

  const std::vector<ir::LoweredArgument> arguments_;
  const jit::ExternPipelines called_;  // called by the code
  const std::shared_ptr<const jit::CompiledFunction> code_;
  const bool is_profiled_;  // if set, every call reports its profile
  const bool writes_on_host_;
};

class JitCompiler : public Compiler {
 public:
  std::shared_ptr<CompiledPipeline> compile(const PipelineSpec& pipeline,
                                            const Target& target) override {
    lower::LowerOptions options;
    options.target = pipeline.traced(target);
    ir::LoweredFunction function =
        lower::lower(pipeline.name, autoschedule::choose_schedule(pipeline, target).graph.outputs,
                     lower::infer_arguments(pipeline.outputs), options);
    jit::Options code_options;
    code_options.externs = pipeline.externs;
    jit::ExternPipelines called = jit::compile_extern_pipelines(pipeline, target);
    function.body = jit::call_pipelines(function.body, called);
    for (const auto& [name, one] : called) code_options.externs[name] = one.code->address();
    auto code = jit::compile(function, target, code_options);
    for (const std::string& note : code->notes()) frontend::tell_warning(note);
    return std::make_shared<JitPipeline>(std::move(function.args), std::move(code),
                                         std::move(called), target);
  }

  std::string loop_nest(const PipelineSpec& pipeline, const Target& target) override {
    return lower::loop_nest_text(autoschedule::choose_schedule(pipeline, target).graph.outputs);
  }
};

}  // namespace

Compiler& default_compiler() {
  static JitCompiler compiler;
  return compiler;
}

}  // namespace retrograde
