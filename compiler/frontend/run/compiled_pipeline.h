// compiled_pipeline.h -- a pipeline as the compiler takes it, and the compiled code that it returns.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "frontend/run/jit_handlers.h"
#include "frontend/schedule/autoschedule_options.h"
#include "graph/function.h"
#include "ir/lowered_function.h"
#include "ir/target.h"

namespace retrograde {

// A pipeline as the compiler takes it.
struct PipelineSpec {
  std::string name;
  std::vector<graph::FuncPtr> outputs;
  std::map<std::string, void*> externs = {};  // C functions by name, before symbols of the process
  bool is_traced = false;                     // whether calls report their begin and end
  AutoscheduleOptions autoschedule = {};      // for Funcs without directives
  // Pipelines by the name under which extern stages call them; see JITExtern.
  std::map<std::string, std::shared_ptr<const PipelineSpec>> pipelines = {};

  Target traced(Target target) const {
    if (is_traced) target.set_feature(Target::TracePipeline);
    return target;
  }
};

// The environment of one call. Handlers may run on several threads at once.
struct CallContext {
  std::function<void(const char*)> print;  // receives text of print(); empty: discarded
  int thread_limit = 0;                    // 0: no limit
  JITHandlers handlers;                    // those that are set replace the runtime's
  JITUserContext* user_context = nullptr;  // passed to handlers; not null if a handler is set
  std::string error;                       // out: message of the error code that run() returned
};

// Compiled code of a pipeline.
class CompiledPipeline {
 public:
  virtual ~CompiledPipeline() = default;
  // Parameters in the order of parameters_of(outputs), then one buffer for each value of each output.
  virtual const std::vector<ir::LoweredArgument>& arguments() const = 0;
  // Runs the code. argv[i] is the halide_buffer_t* of a buffer, or a pointer to a scalar. If an input buffer
  // has neither host nor device memory, the call is a bounds query: it writes the required shapes into such
  // buffers and computes nothing. Returns 0 or an error code, with the message in context.error. Never
  // throws. Thread-safe.
  virtual int run(void* const* argv, CallContext& context) const = 0;
};

}  // namespace retrograde
