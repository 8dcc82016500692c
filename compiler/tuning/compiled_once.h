// compiled_once.h -- a lowered function compiled to be measured: nothing is told of its calls.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "frontend/run/compiled_pipeline.h"
#include "jit/jit.h"
#include "retrograde_runtime.h"

namespace retrograde::tuning {

class CompiledOnce : public CompiledPipeline {
 public:
  CompiledOnce(const ir::LoweredFunction& function, const Target& target,
               const std::map<std::string, void*>& externs)
      : arguments_(function.args) {
    jit::Options options;
    options.externs = externs;
    code_ = jit::compile(function, target, options);
  }
  const std::vector<ir::LoweredArgument>& arguments() const override { return arguments_; }
  int run(void* const* argv, CallContext& caller) const override {
    retrograde_context context = {};
    context.error_handler = [](retrograde_context* c, int, const char* message) {
      static_cast<CallContext*>(c->user_data)->error = message;
    };
    context.thread_limit = caller.thread_limit;
    context.user_data = &caller;
    return code_->call(&context, const_cast<void**>(argv));
  }

 private:
  const std::vector<ir::LoweredArgument> arguments_;
  std::shared_ptr<const jit::CompiledFunction> code_;
};

}  // namespace retrograde::tuning
