// default_compiler.cpp -- what the front end's realize() reaches: lowering, then machine code in
// this process.
#include "frontend/compiler_interface.h"
#include "jit/jit.h"
#include "lower/lower.h"
#include "retrograde_runtime.h"

namespace retrograde {
namespace {

#ifdef RETROGRADE_VALIDATE
constexpr bool validate_passes = true;
#else
constexpr bool validate_passes = false;
#endif

// The runtime's handlers get the context back: it stands first in this.
struct CallState {
  retrograde_context context = {};
  CallContext* caller = nullptr;
};

CallState& state_of(retrograde_context* context) { return *reinterpret_cast<CallState*>(context); }

void keep_error(retrograde_context* context, int, const char* message) {
  state_of(context).caller->error = message;
}

void hand_on_print(retrograde_context* context, const char* message) {
  if (const auto& print = state_of(context).caller->print) print(message);
}

class JitPipeline : public CompiledPipeline {
 public:
  JitPipeline(std::vector<ir::LoweredArgument> arguments,
              std::shared_ptr<const jit::CompiledFunction> code)
      : arguments_(std::move(arguments)), code_(std::move(code)) {}

  const std::vector<ir::LoweredArgument>& arguments() const override { return arguments_; }

  int run(void* const* argv, CallContext& caller) const override {
    CallState state;
    state.caller = &caller;
    state.context.error_handler = keep_error;
    state.context.print_handler = hand_on_print;
    state.context.thread_limit = caller.thread_limit;
    return code_->call(&state.context, const_cast<void**>(argv));
  }

 private:
  const std::vector<ir::LoweredArgument> arguments_;
  const std::shared_ptr<const jit::CompiledFunction> code_;
};

class JitCompiler : public Compiler {
 public:
  std::shared_ptr<CompiledPipeline> compile(const PipelineSpec& pipeline,
                                            const Target& target) override {
    ir::LowerOptions options;
    options.target = target;
    options.validate = validate_passes;
    ir::LoweredFunction function =
        ir::lower(pipeline.name, pipeline.outputs, ir::infer_arguments(pipeline.outputs), options);
    auto code = jit::compile(function, target);
    return std::make_shared<JitPipeline>(std::move(function.args), std::move(code));
  }

  std::string loop_nest(const PipelineSpec& pipeline, const Target&) override {
    return ir::loop_nest_text(pipeline.outputs);
  }
};

}  // namespace

Compiler& default_compiler() {
  static JitCompiler compiler;
  return compiler;
}

}  // namespace retrograde
